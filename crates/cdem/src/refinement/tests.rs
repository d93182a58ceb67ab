//! Properties of refinement for all meshes and all requested sizes.

use std::collections::BTreeSet;

use crate::element::tests::{distorted, kinds};
use crate::math::adjacency::Adjacency;
use crate::math::vector::{add_scaled, cross, dot, norm, pad, sub};
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};
use crate::refinement::forest::Leaf;
use crate::refinement::overlay::halvings;
use crate::refinement::{BaseMesh, BisectedSimplex, BisectedTetrahedron, BisectedTriangle, Forest};
use fastrand::Rng;

/// A mesh with the data that a forest needs.
pub(super) struct Ground<const D: usize> {
    pub(super) mesh: Mesh<D>,
    around: Adjacency,
}

impl<const D: usize> Ground<D> {
    fn new(mesh: Mesh<D>) -> Self {
        let elements = mesh.elements.iter().map(Element::nodes);
        let around = Adjacency::new(elements, mesh.nodes.len());
        Self { mesh, around }
    }

    /// Builds a box of distorted cells with its nodes numbered at random.
    pub(super) fn random(kind: ElementKind, rng: &mut Rng) -> Self {
        let divisions = std::array::from_fn(|_| rng.usize(1..=3));
        let mut mesh = distorted::<D>(divisions, kind, 0.15 * rng.f64());
        let mut order: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
        rng.shuffle(&mut order);
        let nodes = mesh.nodes.clone();
        for (&new, point) in order.iter().zip(&nodes) {
            mesh.nodes[new as usize] = point.map(|x| x + 0.02 * (rng.f64() - 0.5));
        }
        for element in &mut mesh.elements {
            let nodes: Vec<u32> = element.nodes().iter().map(|&n| order[n as usize]).collect();
            *element = Element::new(kind, &nodes);
        }
        for group in &mut mesh.groups {
            group.nodes.iter_mut().for_each(|n| *n = order[*n as usize]);
            group.nodes.sort_unstable();
        }
        Self::new(mesh)
    }

    /// Builds one simplex with random corners, not too flat.
    pub(super) fn simplex(rng: &mut Rng) -> Self {
        loop {
            let point = |_| std::array::from_fn(|_| rng.f64());
            let nodes: Vec<[f64; D]> = (0..=D).map(point).collect();
            if shape(&nodes) > 0.1 {
                let kind = [ElementKind::Tri3, ElementKind::Tet4][D - 2];
                let corners: Vec<u32> = (0..=D as u32).collect();
                return Self::new(Mesh {
                    nodes,
                    elements: vec![Element::new(kind, &corners)],
                    blocks: vec![MeshBlock {
                        name: "simplex".to_owned(),
                        source: 0,
                        nodes: 0..D as u32 + 1,
                        elements: 0..1,
                    }],
                    ..Mesh::default()
                });
            }
        }
    }

    pub(super) fn base(&self) -> BaseMesh<'_, D> {
        BaseMesh::new(&self.mesh, &self.around)
    }

    pub(super) fn all(&self) -> Vec<u32> {
        (0..self.mesh.elements.len() as u32).collect()
    }

    /// Refines the mesh around some random points, to sizes proportional to the distance.
    pub(super) fn refined<C: BisectedSimplex>(&self, rng: &mut Rng) -> Forest<D, C> {
        let count = rng.usize(1..=3);
        let point = |_| {
            let near = self.mesh.nodes[rng.usize(..self.mesh.nodes.len())];
            near.map(|x| x + 0.3 * (rng.f64() - 0.5))
        };
        let points: Vec<[f64; D]> = (0..count).map(point).collect();
        let finest = 0.06 + 0.5 * rng.f64();
        let grading = 0.7 + 3.0 * rng.f64();
        Forest::new(self.base(), &self.all(), |corners, _| {
            let wanted = |point: &[f64; D]| {
                let near = corners.iter().map(|corner| norm(&sub(corner, point)));
                (grading * near.fold(f64::INFINITY, f64::min)).max(finest)
            };
            let size = size(corners);
            points.iter().any(|point| size > wanted(point))
        })
    }

    /// Returns all elements, refined or not, with the fractions of their volume.
    fn elements<C: BisectedSimplex>(&self, forest: &Forest<D, C>) -> Vec<(Element, f64)> {
        let replaced: BTreeSet<u32> = forest.roots().collect();
        let kept = self.all().into_iter().filter(|e| !replaced.contains(e));
        let kept = kept.map(|e| (self.mesh.elements[e as usize], 1.0));
        let kind = [ElementKind::Tri3, ElementKind::Tet4][D - 2];
        let leaves = forest.leaves();
        let leaves = leaves.map(|leaf| (Element::new(kind, leaf.cell.nodes()), leaf.weight));
        kept.chain(leaves).collect()
    }

    /// Returns the boundary facets on which each node lies, new nodes included.
    fn facets_at<C>(&self, forest: &Forest<D, C>) -> Vec<BTreeSet<usize>>
    where
        C: BisectedSimplex,
    {
        let mut at = vec![BTreeSet::new(); self.mesh.nodes.len()];
        for (number, &facet) in self.mesh.boundary_facets().iter().enumerate() {
            for node in self.mesh.facet_nodes(facet) {
                at[node as usize].insert(number);
            }
        }
        for parents in forest.parents() {
            let of = parents
                .nodes()
                .iter()
                .map(|&node| at[node as usize].clone());
            let common = of.reduce(|a, b| a.intersection(&b).copied().collect());
            at.push(common.unwrap_or_default());
        }
        at
    }
}

/// Returns ∫ ∇N over the elements for each node, m^(D − 1): the load of constant stress on it.
fn areas<const D: usize>(
    elements: &[(Element, f64)],
    point: impl Fn(u32) -> [f64; D],
    count: usize,
) -> Vec<[f64; 3]> {
    let mut areas = vec![[0.0; 3]; count];
    for (element, weight) in elements {
        for facet in element.kind.facets() {
            let nodes: Vec<u32> = facet.iter().map(|&i| element.nodes[i as usize]).collect();
            let at = |k: usize| pad(&point(nodes[k % nodes.len()]));
            let corner = |k: usize| {
                let out = sub(&at(k + 1), &at(k));
                match nodes.len() {
                    2 => cross(&out, &[0.0, 0.0, 1.0]).map(|x| x * if k == 0 { 1.0 } else { -1.0 }),
                    n => cross(&out, &sub(&at(k + n - 1), &at(k))),
                }
            };
            for (k, &node) in nodes.iter().enumerate() {
                let n = nodes.len();
                let area = &mut areas[node as usize];
                match n {
                    2 => add_scaled(area, 0.5 * weight, &corner(k)),
                    3 => add_scaled(area, weight / 6.0, &corner(k)),
                    _ => {
                        // Bilinear: over the three triangles at the corner.
                        for k in [k, k + 1, k + 3] {
                            add_scaled(area, weight / 12.0, &corner(k));
                        }
                    }
                }
            }
        }
    }
    areas
}

/// Returns the longest edge.
pub(super) fn size<const D: usize>(corners: &[[f64; D]]) -> f64 {
    squares(corners).into_iter().fold(0.0, f64::max).sqrt()
}

/// Returns the squares of the edge lengths.
fn squares<const D: usize>(corners: &[[f64; D]]) -> Vec<f64> {
    let pairs = (0..corners.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    pairs
        .map(|(i, j)| norm(&sub(&corners[i], &corners[j])).powi(2))
        .collect()
}

/// Returns the volume, positive for corners in the right order.
pub(super) fn volume<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let matrix = nalgebra::DMatrix::from_fn(D, D, |i, j| corners[j + 1][i] - corners[0][i]);
    matrix.determinant() / [2.0, 6.0][D - 2]
}

/// Returns the shape quality: 1 for a regular simplex, 0 for a flat one. It is volume^(2/D) over
/// the mean square of the edges (in 3-D: Liu and Joe 1994, BIT 34).
fn shape<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let squares = squares(corners);
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    let regular = [3_f64.sqrt() / 4.0, 2_f64.sqrt() / 12.0][D - 2];
    (volume(corners) / regular).max(0.0).powf(2.0 / D as f64) / mean
}

fn corners_of<const D: usize, C: BisectedSimplex>(
    ground: &Ground<D>,
    forest: &Forest<D, C>,
    cell: &C,
) -> Vec<[f64; D]> {
    let nodes = cell.nodes().iter();
    nodes.map(|&n| forest.point(ground.base(), n)).collect()
}

/// Refined meshes fill the same volume with conforming elements: constant stress puts no force on
/// an interior node.
fn conforms<const D: usize, C: BisectedSimplex>(seed: u64, count: usize) {
    for kind in kinds::<D>() {
        let mut halves = 0;
        for case in 0..count {
            let mut rng = Rng::with_seed(seed + case as u64);
            let ground = Ground::<D>::random(kind, &mut rng);
            let forest = ground.refined::<C>(&mut rng);
            let point = |node| forest.point(ground.base(), node);
            let elements = ground.elements(&forest);
            let nodes: BTreeSet<u32> = elements
                .iter()
                .flat_map(|(e, _)| e.nodes())
                .copied()
                .collect();
            let count = ground.mesh.nodes.len() + forest.parents().len();
            assert_eq!(nodes.len(), count, "no node is without elements");
            let areas = areas(&elements, point, count);
            let volume = |areas: &[[f64; 3]]| {
                let nodes = (0..).zip(areas);
                nodes
                    .map(|(n, area)| dot(&pad(&point(n)), area))
                    .sum::<f64>()
                    / D as f64
            };
            let whole = ground
                .mesh
                .elements
                .iter()
                .map(|&e| (e, 1.0))
                .collect::<Vec<_>>();
            let before = volume(&crate::refinement::tests::areas(&whole, point, count));
            assert!(
                (volume(&areas) / before - 1.0).abs() < 1e-13,
                "{kind:?} {case}"
            );
            for (at, area) in ground.facets_at(&forest).iter().zip(&areas) {
                assert!(
                    !at.is_empty() || norm(area) < 1e-14,
                    "{kind:?} {case}: {area:?}"
                );
            }
            for leaf in forest.leaves() {
                assert!(
                    crate::refinement::tests::volume(&corners_of(&ground, &forest, leaf.cell))
                        > 0.0
                );
                halves += usize::from(leaf.weight == 0.5);
            }
        }
        let has_squares = matches!(kind, ElementKind::Wedge6 | ElementKind::Hex8);
        assert_eq!(halves > 0, has_squares, "some lie before whole elements");
    }
}

#[test]
fn refined_plane_meshes_conform() {
    conforms::<2, BisectedTriangle>(1, 60);
}

#[test]
fn refined_solid_meshes_conform() {
    conforms::<3, BisectedTetrahedron>(2, 20);
}

/// Elements are requested no smaller than a half, a quarter or an eighth of their root. They are
/// halved no more often to conform, except rarely, and once, where a smaller element must fit
/// beside a larger one.
fn halved_no_deeper<const D: usize, C: BisectedSimplex>(count: usize) {
    for kind in kinds::<D>() {
        let mut deeper = 0;
        for case in 0..count {
            let mut rng = Rng::with_seed(case as u64);
            let ground = Ground::<D>::random(kind, &mut rng);
            let deepest = rng.u8(1..=3);
            let centre = ground.mesh.nodes[rng.usize(..ground.mesh.nodes.len())];
            let reach = 0.3 * rng.f64();
            let halvings = |root, corners: &_| halvings(&ground.mesh, root, corners);
            let forest: Forest<D, C> =
                Forest::new(ground.base(), &ground.all(), |corners, root| {
                    let near = |corner| norm(&sub(corner, &centre)) <= reach;
                    halvings(root, corners) < deepest && corners.iter().any(near)
                });
            let corners = |leaf: &Leaf<C>| corners_of(&ground, &forest, leaf.cell);
            let found = forest.leaves();
            let found = found.map(|leaf| halvings(leaf.root, &corners(&leaf))).max();
            let found = found.expect("what is near is halved");
            assert!((deepest..=deepest + 1).contains(&found), "{kind:?} {case}");
            deeper += usize::from(found > deepest);
        }
        assert!(deeper * 20 <= count, "{kind:?}: {deeper} of {count}");
    }
}

#[test]
fn to_conform_no_triangle_is_halved_more_often() {
    halved_no_deeper::<2, BisectedTriangle>(100);
}

#[test]
fn to_conform_no_tetrahedron_is_halved_more_often() {
    halved_no_deeper::<3, BisectedTetrahedron>(30);
}

/// Returns the shapes of the descendants of a simplex after `generation` bisections, as edges over
/// the size to six digits, and the worst shape quality.
fn shapes<const D: usize, C: BisectedSimplex>(
    ground: &Ground<D>,
    generation: i32,
) -> (BTreeSet<Vec<i64>>, f64) {
    let finest = volume(&ground.mesh.nodes) / 2_f64.powi(generation) * 1.5;
    let forest: Forest<D, C> =
        Forest::new(ground.base(), &[0], |corners, _| volume(corners) > finest);
    let mut shapes = BTreeSet::new();
    let mut worst = f64::INFINITY;
    for leaf in forest.leaves() {
        let corners = corners_of(ground, &forest, leaf.cell);
        let area = volume(&corners).powf(2.0 / D as f64);
        let squares = squares(&corners).into_iter();
        let mut lengths: Vec<_> = squares
            .map(|square| (1e6 * (square / area).ln()).round() as i64)
            .collect();
        lengths.sort_unstable();
        shapes.insert(lengths);
        worst = worst.min(shape(&corners));
    }
    (shapes, worst)
}

/// The descendants of a simplex have no more than `most` shapes after any number of bisections.
/// None is worse than those of the first `cycle` generations, and these are no worse than the
/// simplex by more than a factor of `bound`.
fn shapes_stay<const D: usize, C: BisectedSimplex>(
    count: usize,
    cycle: i32,
    most: usize,
    bound: f64,
) {
    let mut rng = Rng::with_seed(5);
    for case in 0..count {
        let ground = Ground::<D>::simplex(&mut rng);
        let own = shape(&ground.mesh.nodes);
        let mut all = BTreeSet::new();
        let mut first = own;
        for generation in 1..=cycle {
            let (shapes, worst) = shapes::<D, C>(&ground, generation);
            all.extend(shapes);
            first = first.min(worst);
        }
        let known = all.len();
        assert!(first > bound * own, "case {case}: {first} of {own}");
        for generation in cycle + 1..=cycle + D as i32 + 1 {
            let (shapes, worst) = shapes::<D, C>(&ground, generation);
            all.extend(shapes);
            assert!(worst > (1.0 - 1e-9) * first, "case {case}: {worst} {first}");
        }
        // A few lengths that round to either of two digits count twice.
        assert!(
            all.len() <= known + 1 && known <= most,
            "case {case}: {known}"
        );
    }
}

#[test]
fn triangles_keep_to_four_shapes() {
    // Four (Mitchell 1991). The worst of 20 000 triangles had 0.603 of its own quality.
    shapes_stay::<2, BisectedTriangle>(300, 3, 4, 0.6);
}

#[test]
fn tetrahedra_keep_to_a_finite_number_of_shapes() {
    // 72 (Arnold, Mukherjee and Pouly 2000). The worst of 1500 had 0.301.
    shapes_stay::<3, BisectedTetrahedron>(40, 8, 72, 0.3);
}

#[test]
fn nothing_is_refined_that_is_not_wanted_to() {
    for kind in kinds::<3>() {
        let ground = Ground::<3>::random(kind, &mut Rng::with_seed(3));
        let forest: Forest<3, BisectedTetrahedron> =
            Forest::new(ground.base(), &ground.all(), |_, _| false);
        assert_eq!(forest.roots().count(), 0);
        assert_eq!(forest.leaves().count(), 0);
        assert_eq!(forest.parents(), []);
    }
}
