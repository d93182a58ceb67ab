//! The four traits of a surface on hand-made features: each answer is known on paper.
//!
//! The lower block is a roof of two elements beside a ridge. Its sides fall by a `height` on 4 m:
//! with -3 m their normals are (±3, 4)/5, with 0 the roof is flat, with 3 m it is a valley. The
//! upper block is a tip with one corner down, or in space a keel with one edge down.

mod contact_geometry;
mod distance;
mod time_of_impact;
mod topology;

use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Pair, Projection, Topology};
use crate::math::vector::{add, add_scaled, norm, sub};
use crate::mesh::{Element, ElementKind, Mesh, MeshBlock};

/// Largest round-off of some ten operations on lengths of at most 8 m, m.
const ROUND_OFF: f64 = 1e-14;

/// Contact resolution of the tests, m.
const TOLERANCE: f64 = 1e-3;

/// Thickness of the blocks in the plane, m.
const THICKNESS: f64 = 2.0;

/// Height of the sides of a roof, of a flat top and of a valley, m.
const ROOF: f64 = -3.0;
const FLAT: f64 = 0.0;
const VALLEY: f64 = 3.0;

/// Nodes of the roof in the plane: its ridge at the origin, and the ends of its sides.
mod plane {
    pub(super) const RIDGE: u32 = 0;
    pub(super) const LEFT: u32 = 1;
    pub(super) const RIGHT: u32 = 2;
    /// The lowest node of the upper block.
    pub(super) const TIP: u32 = 4;
    /// The edges on both sides of the ridge, with the block to their left.
    pub(super) const LEFT_SIDE: [u32; 2] = [RIDGE, LEFT];
    pub(super) const RIGHT_SIDE: [u32; 2] = [RIGHT, RIDGE];
}

/// Nodes of the roof in space: the ends of its ridge, and the far corners of its sides.
mod space {
    /// The ridge, in the direction of its edge.
    pub(super) const RIDGE: [u32; 2] = [1, 0];
    /// The triangle on the side of positive y.
    pub(super) const SIDE: [u32; 3] = [0, 1, 3];
    /// The triangle on the side of negative y.
    pub(super) const OTHER_SIDE: [u32; 3] = [0, 1, 2];
    /// The lowest node of a tip.
    pub(super) const TIP: u32 = 5;
    /// The lowest edge of a keel, in its direction: to negative y.
    pub(super) const KEEL: [u32; 2] = [6, 5];
}

/// Nodes and elements of a hand-made block. Elements number the nodes of their block from 0.
struct HandMade<const D: usize> {
    kind: ElementKind,
    nodes: Vec<[f64; D]>,
    elements: Vec<Vec<u32>>,
}

/// Returns a mesh of some blocks.
fn mesh<const D: usize>(blocks: &[HandMade<D>]) -> Mesh<D> {
    let mut mesh = Mesh::default();
    for (number, block) in blocks.iter().enumerate() {
        let (node, element) = (mesh.nodes.len() as u32, mesh.elements.len() as u32);
        mesh.nodes.extend(&block.nodes);
        for own in &block.elements {
            let nodes: Vec<u32> = own.iter().map(|own| node + own).collect();
            mesh.elements.push(Element::new(block.kind, &nodes));
        }
        mesh.blocks.push(MeshBlock {
            name: number.to_string(),
            source: number,
            nodes: node..mesh.nodes.len() as u32,
            elements: element..mesh.elements.len() as u32,
        });
    }
    mesh
}

/// Returns a roof in the plane, with its ridge at the origin.
fn roof_2d(height: f64) -> HandMade<2> {
    HandMade {
        kind: ElementKind::Tri3,
        nodes: vec![[0.0, 0.0], [-4.0, height], [4.0, height], [0.0, -8.0]],
        elements: vec![vec![0, 1, 3], vec![0, 3, 2]],
    }
}

/// Returns a block in the plane with a right angle that points down to a place.
fn tip_2d(place: [f64; 2]) -> HandMade<2> {
    HandMade {
        kind: ElementKind::Tri3,
        nodes: [[0.0, 0.0], [4.0, 4.0], [-4.0, 4.0]]
            .map(|from| add(&place, &from))
            .to_vec(),
        elements: vec![vec![0, 1, 2]],
    }
}

/// Returns a roof in space, with its ridge from (-1, 0, 0) to (3, 0, 0).
fn roof_3d(height: f64) -> HandMade<3> {
    HandMade {
        kind: ElementKind::Tet4,
        nodes: vec![
            [-1.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
            [0.0, -4.0, height],
            [0.0, 4.0, height],
            [0.0, 0.0, -8.0],
        ],
        elements: vec![vec![0, 1, 2, 4], vec![0, 1, 4, 3]],
    }
}

/// Returns a block in space with a corner that points down to a place.
fn tip_3d(place: [f64; 3]) -> HandMade<3> {
    let nodes = [
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 4.0],
        [0.0, 4.0, 4.0],
        [-4.0, -4.0, 4.0],
    ];
    HandMade {
        kind: ElementKind::Tet4,
        nodes: nodes.map(|from| add(&place, &from)).to_vec(),
        elements: vec![vec![0, 1, 2, 3]],
    }
}

/// Returns a block in space with an edge down, which runs by 2 m along y about a place.
fn keel(place: [f64; 3]) -> HandMade<3> {
    let nodes = [
        [0.0, -1.0, 0.0],
        [0.0, 1.0, 0.0],
        [-4.0, 0.0, 4.0],
        [4.0, 0.0, 4.0],
    ];
    HandMade {
        kind: ElementKind::Tet4,
        nodes: nodes.map(|from| add(&place, &from)).to_vec(),
        elements: vec![vec![0, 1, 2, 3]],
    }
}

/// A mesh of a roof and an upper block, with its boundary in the plane.
fn over_roof_2d(height: f64, upper: HandMade<2>) -> (Mesh<2>, Boundary2d) {
    let mesh = mesh(&[roof_2d(height), upper]);
    let boundary = Boundary2d::new(&mesh, THICKNESS);
    (mesh, boundary)
}

/// A mesh of a roof and an upper block, with its boundary in space.
fn over_roof_3d(height: f64, upper: HandMade<3>) -> (Mesh<3>, Boundary3d) {
    let mesh = mesh(&[roof_3d(height), upper]);
    let boundary = Boundary3d::new(&mesh, TOLERANCE);
    (mesh, boundary)
}

/// Returns the pair of the features with these nodes, in any order.
fn pair<const D: usize>(surface: &dyn Topology<D>, main: &[u32], target: &[u32]) -> Pair {
    let is_of = |nodes: &[u32], wanted: &[u32]| {
        nodes.len() == wanted.len() && wanted.iter().all(|node| nodes.contains(node))
    };
    for [mains, targets] in surface.families() {
        let main = mains.clone().find(|&n| is_of(surface.main_nodes(n), main));
        let target = targets
            .clone()
            .find(|&n| is_of(surface.target_nodes(n), target));
        if let (Some(main), Some(target)) = (main, target) {
            return Pair { main, target };
        }
    }
    panic!("no pair of {main:?} and {target:?}")
}

/// Returns the point of a target edge or triangle at the weights `foot`, m.
fn foot_point<const D: usize>(
    surface: &dyn Topology<D>,
    target: u32,
    nodes: &[[f64; D]],
    foot: [f64; 2],
) -> [f64; D] {
    let corners = surface.target_nodes(target);
    let mut point = nodes[corners[0] as usize];
    for (&corner, weight) in corners[1..].iter().zip(foot) {
        let away = sub(&nodes[corner as usize], &nodes[corners[0] as usize]);
        add_scaled(&mut point, weight, &away);
    }
    point
}

/// Returns velocities of 0 for the lower nodes, and of `upper` from the node `first` on, m/s.
fn velocities<const D: usize>(mesh: &Mesh<D>, first: u32, upper: [f64; D]) -> Vec<[f64; D]> {
    let mut velocity = vec![[0.0; D]; mesh.nodes.len()];
    velocity[first as usize..].fill(upper);
    velocity
}

/// Asserts that two vectors agree up to round-off.
#[track_caller]
fn assert_close<const N: usize>(found: [f64; N], expected: [f64; N]) {
    let apart = norm(&sub(&found, &expected));
    assert!(apart <= ROUND_OFF, "{found:?} is not {expected:?}");
}

/// Asserts the gap of a projection and its distance outside the target, m.
#[track_caller]
fn assert_projection(projection: Projection, gap: f64, outside: f64) {
    assert_close([projection.gap, projection.outside], [gap, outside]);
}
