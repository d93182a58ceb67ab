//! The overlay of a block: new elements in place of some base elements.

use crate::element::tensor;
use crate::math::vector::{add, scale};
use crate::mesh::{Element, ElementKind, Mesh};
use crate::refinement::base_mesh::BaseMesh;
use crate::refinement::bisection::{BisectedSimplex, BisectedTetrahedron, BisectedTriangle};
use crate::refinement::forest::{Forest, Lineage};
use crate::refinement::interpolation::ElementInterpolation;
use crate::refinement::simplex_split;
use crate::refinement::zone::size;

/// The elements of a block that replace elements of its base mesh, and the new nodes. Nodes are
/// numbered within the block; new nodes follow those of the base mesh.
#[derive(Clone, Debug)]
pub(crate) struct Overlay<const D: usize> {
    /// Number of base nodes of the block.
    pub(crate) base_count: usize,
    /// Rest positions of all nodes, m.
    pub(crate) points: Vec<[f64; D]>,
    /// Parents of each new node; it lies at their mean.
    pub(super) parents: Vec<Vec<u32>>,
    /// For each new node in a non-simplex element, that element.
    pub(super) inside: Vec<Option<InteriorNode>>,
    /// Base nodes between which each new node lies, found through its parents.
    pub(super) hulls: Vec<Vec<u32>>,
    /// Replaced elements of the mesh, ascending.
    pub(crate) replaced: Vec<u32>,
    /// The elements that replace them, in the same order.
    pub(crate) elements: Vec<SubElement>,
}

/// Returns true if an element with these corners, m, is to be smaller; the number is that of its
/// root element of the mesh.
pub(crate) type RefinementRequest<'a, const D: usize> = &'a dyn Fn(&[[f64; D]], u32) -> bool;

/// Builds the overlay of a block of the mesh, if any element is to be smaller.
pub(crate) type MakeOverlay<const D: usize> =
    fn(BaseMesh<D>, &Mesh<D>, usize, RefinementRequest<D>) -> Option<Overlay<D>>;

/// Builds overlays of triangles.
pub(crate) fn plane_overlay(
    base: BaseMesh<2>,
    mesh: &Mesh<2>,
    block: usize,
    wanted: RefinementRequest<2>,
) -> Option<Overlay<2>> {
    overlay::<2, BisectedTriangle>(base, mesh, block, wanted)
}

/// Builds overlays of tetrahedra.
pub(crate) fn solid_overlay(
    base: BaseMesh<3>,
    mesh: &Mesh<3>,
    block: usize,
    wanted: RefinementRequest<3>,
) -> Option<Overlay<3>> {
    overlay::<3, BisectedTetrahedron>(base, mesh, block, wanted)
}

fn overlay<const D: usize, C: BisectedSimplex>(
    base: BaseMesh<D>,
    mesh: &Mesh<D>,
    block: usize,
    wanted: RefinementRequest<D>,
) -> Option<Overlay<D>> {
    let elements: Vec<u32> = mesh.blocks[block].elements.clone().collect();
    let forest: Forest<D, C> = Forest::new(base, &elements, wanted);
    Overlay::new(mesh, base, block, &forest)
}

/// A node in a non-simplex element.
#[derive(Clone, Debug)]
pub(super) struct InteriorNode {
    pub(super) root: u32,
    /// Weights of the corners in the value of a field at the node.
    pub(super) weights: Vec<(u32, f64)>,
}

/// A simplex in place of an element or of a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SubElement {
    pub(crate) element: Element,
    /// The element of the mesh from which it comes.
    pub(crate) root: u32,
    /// Fraction of its volume that it stands for.
    pub(crate) weight: f64,
    /// The part of the root element that it is.
    pub(crate) lineage: Lineage,
    /// Number of halvings in size from the root element.
    pub(crate) halvings: u8,
}

impl<const D: usize> Overlay<D> {
    /// Builds the overlay of one block from a forest; `None` if no element is replaced.
    pub(crate) fn new<C: BisectedSimplex>(
        mesh: &Mesh<D>,
        base: BaseMesh<D>,
        block: usize,
        forest: &Forest<D, C>,
    ) -> Option<Self> {
        let nodes = mesh.blocks[block].nodes.clone();
        let base_count = nodes.len();
        let local = |node: u32| match node.checked_sub(mesh.nodes.len() as u32) {
            None => node - nodes.start,
            Some(new) => base_count as u32 + new,
        };
        let kind = if D == 2 {
            ElementKind::Tri3
        } else {
            ElementKind::Tet4
        };
        let mut leaves: Vec<_> = forest.leaves().collect();
        leaves.sort_by_key(|leaf| leaf.root);
        let elements = leaves.into_iter().map(|leaf| {
            let nodes: Vec<u32> = leaf.cell.nodes().iter().map(|&n| local(n)).collect();
            let corners = leaf.cell.nodes().iter();
            let corners: Vec<_> = corners.map(|&n| forest.point(base, n)).collect();
            SubElement {
                element: Element::new(kind, &nodes),
                root: leaf.root,
                weight: leaf.weight,
                lineage: leaf.lineage,
                halvings: halvings(mesh, leaf.root, &corners),
            }
        });
        let new = (0..forest.parents().len()).map(|k| (mesh.nodes.len() + k) as u32);
        let all = nodes.clone().chain(new);
        let parents = forest.parents().iter();
        let parents: Vec<Vec<u32>> = parents
            .map(|parents| parents.nodes().iter().map(|&n| local(n)).collect())
            .collect();
        let mut replaced: Vec<u32> = forest.roots().collect();
        replaced.sort_unstable();
        let elements: Vec<SubElement> = elements.collect();
        let points: Vec<[f64; D]> = all.map(|node| forest.point(base, node)).collect();
        let mut overlay = Self {
            base_count,
            hulls: hulls(base_count, &parents),
            inside: vec![None; parents.len()],
            points,
            parents,
            replaced,
            elements,
        };
        overlay.inside = overlay.all_inside(mesh, nodes.start);
        (!overlay.replaced.is_empty()).then_some(overlay)
    }

    /// Finds the new nodes in non-simplex elements. The nodes of the block in the mesh begin at
    /// `first`.
    fn all_inside(&self, mesh: &Mesh<D>, first: u32) -> Vec<Option<InteriorNode>> {
        let mut found = vec![None; self.parents.len()];
        for parts in self.elements.chunk_by(|one, other| one.root == other.root) {
            let root = parts[0].root;
            let element = &mesh.elements[root as usize];
            if simplex_split::is_simplex(element.kind) {
                continue;
            }
            let own: Vec<u32> = element.nodes().iter().map(|node| node - first).collect();
            let element = Element::new(element.kind, &own);
            let mut inside =
                ElementInterpolation::new(element, &self.points, self.base_count, &self.parents);
            for &node in parts.iter().flat_map(|part| part.element.nodes()) {
                if let Some(new) = (node as usize).checked_sub(self.base_count) {
                    found[new].get_or_insert_with(|| InteriorNode {
                        root,
                        weights: inside.weights(node),
                    });
                }
            }
        }
        found
    }

    /// Returns true if an element of the mesh is replaced.
    pub(super) fn replaces(&self, element: u32) -> bool {
        self.replaced.binary_search(&element).is_ok()
    }

    /// Returns true if a node lies on a facet, given by its nodes of the base mesh.
    pub(super) fn lies_on(&self, node: u32, facet: &[u32]) -> bool {
        match (node as usize).checked_sub(self.base_count) {
            None => facet.contains(&node),
            Some(new) => self.hulls[new].iter().all(|node| facet.contains(node)),
        }
    }

    /// Returns, for each element, the gradients of the shape functions, 1/m, and the volume, m^D,
    /// weight included.
    pub(super) fn gradients(&self) -> impl Iterator<Item = (Vec<[f64; D]>, f64)> + '_ {
        self.elements.iter().map(|sub| {
            let nodes = sub.element.nodes();
            let at = |node: u32| self.points[node as usize];
            let side = |i: usize, k: usize| at(nodes[k + 1])[i] - at(nodes[0])[i];
            let (inverse, determinant) = tensor::inverse(&tensor::filled(side));
            let volume = sub.weight * determinant / (1..=D).product::<usize>() as f64;
            let row = |k: usize| inverse[k];
            let others: Vec<_> = (0..D).map(row).collect();
            let sum = others
                .iter()
                .fold([0.0; D], |sum, gradient| add(&sum, gradient));
            let first = scale(-1.0, &sum);
            (std::iter::once(first).chain(others).collect(), volume)
        })
    }

    /// Returns the volume mean of the gradient of a vector field, one row per component.
    pub(super) fn mean_gradient(&self, field: &[[f64; D]]) -> Vec<[f64; D]> {
        let whole: f64 = self.volumes().sum();
        let mut mean = vec![[0.0; D]; D];
        for (piece, (gradients, volume)) in self.elements.iter().zip(self.gradients()) {
            for (&node, gradient) in piece.element.nodes().iter().zip(&gradients) {
                for c in 0..D {
                    let value = field[node as usize][c];
                    mean[c] = add(&mean[c], &scale(value * volume / whole, gradient));
                }
            }
        }
        mean
    }

    /// Returns the volume of each element, m^D, weight included.
    pub(super) fn volumes(&self) -> impl Iterator<Item = f64> + '_ {
        self.gradients().map(|(_, volume)| volume)
    }

    /// Returns the row sums of the mass matrix of the new elements, kg, for a `density`, kg/m^D.
    #[cfg(test)]
    pub(super) fn lumped(&self, density: f64) -> Vec<f64> {
        let mut masses = vec![0.0; self.points.len()];
        for (sub, volume) in self.elements.iter().zip(self.volumes()) {
            for &node in sub.element.nodes() {
                masses[node as usize] += density * volume / (D + 1) as f64;
            }
        }
        masses
    }
}

/// Returns the number of halvings in size from an element to a part with these corners, up to
/// round-off.
pub(super) fn halvings<const D: usize>(mesh: &Mesh<D>, element: u32, corners: &[[f64; D]]) -> u8 {
    let nodes = mesh.elements[element as usize].nodes().iter();
    let whole: Vec<[f64; D]> = nodes.map(|&node| mesh.nodes[node as usize]).collect();
    ((size(&whole) / size(corners)).log2() + 1e-6) as u8
}

/// Returns, for each new node, those of the first `count` nodes between which it lies.
fn hulls(count: usize, parents: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut hulls: Vec<Vec<u32>> = Vec::with_capacity(parents.len());
    for parents in parents {
        let mut hull = Vec::new();
        for &parent in parents {
            match (parent as usize).checked_sub(count) {
                None => hull.push(parent),
                Some(new) => hull.extend(&hulls[new]),
            }
        }
        hull.sort_unstable();
        hull.dedup();
        hulls.push(hull);
    }
    hulls
}
