//! A block with some of its elements replaced.

use super::base::Base;
use super::cell::Cell;
use super::forest::Forest;
use crate::mesh::{Element, ElementKind, Mesh};
use crate::vector::{add, scale};

/// The mesh of a block over its base mesh: the elements that replace others, and the
/// new nodes. Nodes are numbered within the block, new ones on from those of the base.
#[derive(Clone, Debug)]
pub(crate) struct Overlay<const D: usize> {
    /// Nodes of the block before.
    pub(crate) base_count: usize,
    /// Rest positions of all nodes, m.
    pub(crate) points: Vec<[f64; D]>,
    /// The nodes between which each new node lies, all of the same weight.
    parents: Vec<Vec<u32>>,
    /// Elements of the mesh that are replaced, ascending.
    pub(crate) replaced: Vec<u32>,
    /// What replaces them.
    pub(crate) elements: Vec<SubElement>,
}

/// A simplex in the place of an element, or of a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SubElement {
    pub(crate) element: Element,
    /// Share of its volume that it stands for.
    pub(crate) weight: f64,
}

impl<const D: usize> Overlay<D> {
    /// What a forest in one block has become, if that is anything.
    pub(crate) fn new<C: Cell>(
        mesh: &Mesh<D>,
        base: Base<D>,
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
        let elements = forest.leaves().map(|leaf| {
            let nodes: Vec<u32> = leaf.cell.nodes().iter().map(|&n| local(n)).collect();
            SubElement {
                element: Element::new(kind, &nodes),
                weight: leaf.weight,
            }
        });
        let new = (0..forest.parents().len()).map(|k| (mesh.nodes.len() + k) as u32);
        let all = nodes.clone().chain(new);
        let parents = forest.parents().iter();
        let mut replaced: Vec<u32> = forest.roots().collect();
        replaced.sort_unstable();
        (!replaced.is_empty()).then(|| Self {
            base_count,
            points: all.map(|node| forest.point(base, node)).collect(),
            parents: parents
                .map(|parents| parents.nodes().iter().map(|&n| local(n)).collect())
                .collect(),
            replaced,
            elements: elements.collect(),
        })
    }

    /// Gives the new nodes the mean of those between which they lie: what varies
    /// linearly in an element is interpolated exactly.
    pub(crate) fn spread(&self, values: &mut Vec<[f64; D]>) {
        debug_assert_eq!(values.len(), self.base_count);
        for parents in &self.parents {
            let of = parents.iter().map(|&node| &values[node as usize]);
            let sum = of.fold([0.0; D], |sum, value| add(&sum, value));
            values.push(scale(1.0 / parents.len() as f64, &sum));
        }
    }

    /// The transpose of that: what the new nodes have goes to those between which they
    /// lie, in equal parts.
    pub(crate) fn gather(&self, values: &mut Vec<[f64; D]>) {
        for parents in self.parents.iter().rev() {
            let Some(value) = values.pop() else { return };
            for &node in parents {
                let to = &mut values[node as usize];
                *to = add(to, &scale(1.0 / parents.len() as f64, &value));
            }
        }
    }

    /// Volume of each element, m^D, its weight included.
    pub(crate) fn volumes(&self) -> impl Iterator<Item = f64> + '_ {
        self.elements.iter().map(|sub| {
            let [origin, corners @ ..] = sub.element.nodes() else {
                return 0.0;
            };
            let at = |node: &u32| self.points[*node as usize];
            let side = |i: usize, k: usize| at(&corners[k])[i] - at(origin)[i];
            let sides = nalgebra::DMatrix::from_fn(D, D, side);
            sub.weight * sides.determinant() / (1..=D).product::<usize>() as f64
        })
    }

    /// Row sums of the mass matrix of the new elements, kg, for a `density`, kg/m^D.
    pub(crate) fn lumped(&self, density: f64) -> Vec<f64> {
        let mut masses = vec![0.0; self.points.len()];
        for (sub, volume) in self.elements.iter().zip(self.volumes()) {
            for &node in sub.element.nodes() {
                masses[node as usize] += density * volume / (D + 1) as f64;
            }
        }
        masses
    }
}
