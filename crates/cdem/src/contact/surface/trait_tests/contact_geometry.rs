//! Tests of [`ContactGeometry`](crate::contact::surface::ContactGeometry).

use super::{
    FLAT, HandMade, ROOF, THICKNESS, TOLERANCE, assert_close, foot_point, keel, mesh, over_roof_2d,
    over_roof_3d, pair, plane, space, tip_2d, tip_3d,
};
use crate::contact::surface::boundary_2d::Boundary2d;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::{
    Configuration, ContactGeometry, ContactJacobian, Distance, FeatureKind, JacobianAnchor, Pair,
};
use crate::math::vector::{add, cross, cross2};
use crate::mesh::ElementKind;

/// Returns the impulses on all nodes, N s, that an impulse in the frame of a contact makes.
fn impulses<const D: usize>(
    jacobian: &ContactJacobian<D>,
    impulse: [f64; D],
    count: usize,
) -> Vec<[f64; D]> {
    let mut all = vec![[0.0; D]; count];
    jacobian.apply_transpose(&impulse, |node, on| {
        let sum = &mut all[node as usize];
        *sum = add(sum, on);
    });
    all
}

/// Returns the sum of impulses, N s.
fn sum<const D: usize>(impulses: &[[f64; D]]) -> [f64; D] {
    impulses.iter().fold([0.0; D], |sum, on| add(&sum, on))
}

/// Returns two unit tetrahedra that share the place of one face: one below it and one above.
fn flush_tetrahedra() -> [HandMade<3>; 2] {
    let face = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let block = |apex: f64, elements: Vec<u32>| HandMade {
        kind: ElementKind::Tet4,
        nodes: [face.as_slice(), &[[0.0, 0.0, apex]]].concat(),
        elements: vec![elements],
    };
    [block(-1.0, vec![0, 2, 1, 3]), block(1.0, vec![0, 1, 2, 3])]
}

/// Returns two unit squares, the second above the first and half beside it.
fn flush_squares() -> [HandMade<2>; 2] {
    let square = |shift: [f64; 2]| HandMade {
        kind: ElementKind::Quad4,
        nodes: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|corner| add(&corner, &shift))
            .to_vec(),
        elements: vec![vec![0, 1, 2, 3]],
    };
    [square([0.0, 0.0]), square([0.5, 1.0])]
}

#[test]
fn a_vertex_within_an_edge_has_no_adjacent_pairs() {
    let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([1.0, -0.75]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    assert!(boundary.adjacent_pairs(pair, at, TOLERANCE).is_empty());
}

#[test]
fn two_corners_in_the_plane_have_the_pairs_of_each_with_both_edges_of_the_other() {
    let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([0.0, 0.0]));
    let at = Configuration::at_rest(&mesh.nodes);
    let of = |main: u32, target: &[u32]| pair(&boundary, &[main], target);
    let own = of(plane::TIP, &plane::RIGHT_SIDE);
    let mut found = boundary.adjacent_pairs(own, at, TOLERANCE).to_vec();
    found.sort_unstable();
    let mut expected = vec![
        own,
        of(plane::TIP, &plane::LEFT_SIDE),
        of(plane::RIDGE, &[plane::TIP, plane::TIP + 1]),
        of(plane::RIDGE, &[plane::TIP, plane::TIP + 2]),
    ];
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn a_vertex_within_a_triangle_has_its_own_pair_alone() {
    let (mesh, boundary) = over_roof_3d(ROOF, tip_3d([0.5, 1.0, -0.75]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP], &space::SIDE);
    let found = boundary.adjacent_pairs(pair, at, TOLERANCE);
    assert_eq!(found.as_slice(), [pair]);
}

#[test]
fn a_vertex_on_a_ridge_has_both_sides_and_the_ridge_with_its_edges() {
    let (mesh, boundary) = over_roof_3d(ROOF, tip_3d([0.0, 0.0, 0.0]));
    let at = Configuration::at_rest(&mesh.nodes);
    let own = pair(&boundary, &[space::TIP], &space::SIDE);
    let mut found = boundary.adjacent_pairs(own, at, TOLERANCE).to_vec();
    found.sort_unstable();
    let sides = [&space::SIDE, &space::OTHER_SIDE];
    let vertex = sides.map(|side| pair(&boundary, &[space::TIP], side));
    let edges = [1, 2, 3].map(|k| pair(&boundary, &space::RIDGE, &[space::TIP, space::TIP + k]));
    let mut expected = [vertex.as_slice(), &edges].concat();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn a_vertex_in_the_plane_moves_on_to_the_next_edge_unless_it_turns_by_a_right_angle() {
    let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([-0.5, 0.0]));
    let at = Configuration::at_rest(&mesh.nodes);
    let [left, right] =
        [&plane::LEFT_SIDE, &plane::RIGHT_SIDE].map(|side| pair(&boundary, &[plane::TIP], side));
    let beyond = |foot: f64| boundary.neighbour(right, &[foot, 0.0], at);
    assert_eq!(beyond(1.1), Some(left));
    // The underside of the roof.
    assert_eq!(beyond(-0.1), None);
}

#[test]
fn a_vertex_in_space_moves_on_to_the_next_triangle_unless_it_turns_by_a_right_angle() {
    let next = |place: [f64; 3]| {
        let (mesh, boundary) = over_roof_3d(ROOF, tip_3d(place));
        let at = Configuration::at_rest(&mesh.nodes);
        let [one, other] =
            [&space::SIDE, &space::OTHER_SIDE].map(|side| pair(&boundary, &[space::TIP], side));
        let foot = boundary.project(one, at).foot;
        (boundary.neighbour(one, &foot, at), other)
    };
    let (found, other) = next([0.5, -0.5, 0.0]);
    assert_eq!(found, Some(other));
    // The underside of the roof.
    let (found, _) = next([0.0, 4.5, -3.0]);
    assert_eq!(found, None);
}

#[test]
fn the_jacobian_in_the_plane_gives_the_relative_velocity_in_its_frame() {
    let (mesh, boundary) = over_roof_2d(FLAT, tip_2d([1.0, 0.0]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    // The foot lies 3 m from the start of the edge of 4 m.
    let jacobian = boundary.jacobian(pair, &[0.75, 0.0], at);
    assert_eq!(jacobian.frame, [[0.0, 1.0], [-1.0, 0.0]]);
    let [start, end] = plane::RIGHT_SIDE;
    assert_eq!(jacobian.nodes(), [plane::TIP, start, end]);
    let mut velocity = vec![[0.0; 2]; mesh.nodes.len()];
    velocity[plane::TIP as usize] = [2.0, -1.0];
    assert_eq!(jacobian.relative_velocities(&velocity), [-1.0, -2.0]);
    velocity[start as usize] = [0.0, 4.0];
    velocity[end as usize] = [0.0, 8.0];
    assert_eq!(jacobian.relative_velocities(&velocity), [-1.0 - 7.0, -2.0]);
}

#[test]
fn impulses_in_the_plane_balance_at_any_gap() {
    let (mesh, boundary) = over_roof_2d(FLAT, tip_2d([1.0, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    let jacobian = boundary.jacobian(pair, &[0.75, 0.0], at);
    assert_eq!(jacobian.offset, [0.25, 0.0]);
    let on = impulses(&jacobian, [1.0, 2.0], mesh.nodes.len());
    // 1 N s up and 2 N s to the left.
    assert_eq!(on[plane::TIP as usize], [-2.0, 1.0]);
    assert_close(sum(&on), [0.0; 2]);
    let moments = on.iter().zip(&mesh.nodes).map(|(on, x)| cross2(x, on));
    assert_close([moments.sum::<f64>()], [0.0]);
}

#[test]
fn the_jacobian_of_a_vertex_and_a_triangle_gives_the_relative_velocity_in_its_frame() {
    let (mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.5, 1.0, 0.0]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP], &space::SIDE);
    let foot = boundary.project(pair, at).foot;
    let jacobian = boundary.jacobian(pair, &foot, at);
    assert_eq!(jacobian.frame[0], [0.0, 0.0, 1.0]);
    assert_eq!(jacobian.count, 4);
    let mut velocity = vec![[0.0; 3]; mesh.nodes.len()];
    velocity[space::TIP as usize] = [0.0, 0.0, -1.0];
    assert_close([jacobian.relative_velocity(0, &velocity)], [-1.0]);
    // The far corner of the triangle has a weight of 1/4.
    velocity[3] = [0.0, 0.0, 8.0];
    assert_close([jacobian.relative_velocity(0, &velocity)], [-1.0 - 2.0]);
}

#[test]
fn the_jacobian_of_two_edges_has_its_normal_on_the_side_asked_for() {
    let (mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
    let foot = [0.75, 0.5];
    // Out of the keel, which is the target.
    assert_eq!(
        boundary.jacobian(pair, &foot, at).frame[0],
        [0.0, 0.0, -1.0]
    );
    let mut jacobian = ContactJacobian::default();
    for z in [1.0, -1.0] {
        let along = [0.0, 0.0, z];
        let anchor = JacobianAnchor {
            foot: &foot,
            along: Some(&along),
        };
        boundary.assemble_jacobian(&mut jacobian, pair, anchor, at);
        assert_eq!(jacobian.frame[0], along);
        assert_close([jacobian.offset[0]], [-0.25 * z]);
        let on = impulses(&jacobian, [1.0, 0.0, 0.0], mesh.nodes.len());
        // The ridge is the main edge: 3/4 of the impulse on its nearer end, 1/4 on the other.
        assert_close(on[0], [0.0, 0.0, 0.75 * z]);
        assert_close(on[1], [0.0, 0.0, 0.25 * z]);
        assert_close(on[5], [0.0, 0.0, -0.5 * z]);
    }
}

#[test]
fn impulses_in_space_balance_at_any_gap() {
    let balances = |boundary: &Boundary3d, nodes: &[[f64; 3]], pair: Pair| {
        let at = Configuration::at_rest(nodes);
        let foot = boundary.project(pair, at).foot;
        let jacobian = boundary.jacobian(pair, &foot, at);
        let on = impulses(&jacobian, [1.0, 2.0, 4.0], nodes.len());
        assert_close(sum(&on), [0.0; 3]);
        let moments = on.iter().zip(nodes).map(|(on, x)| cross(x, on));
        assert_close(sum(&moments.collect::<Vec<_>>()), [0.0; 3]);
    };
    let (mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.5, 1.0, 0.25]));
    let vertex = pair(&boundary, &[space::TIP], &space::SIDE);
    balances(&boundary, &mesh.nodes, vertex);
    let (mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 0.25]));
    let edges = pair(&boundary, &space::RIDGE, &space::KEEL);
    balances(&boundary, &mesh.nodes, edges);
}

#[test]
fn material_points_in_the_plane_are_found_again() {
    let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([1.0, 2.0]));
    let rest = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    let points = boundary.material_points(pair, &[0.75, 0.0], rest);
    assert_eq!(points.map(|p| p.position), [[1.0, 2.0], [1.0, -0.75]]);
    let kinds = points.map(|point| point.kind);
    assert_eq!(kinds, [FeatureKind::Vertex, FeatureKind::Face]);
    assert_close(points[1].outward, [0.6, 0.8]);
    let blocks = [1, 0].map(|block: usize| mesh.blocks[block].nodes.clone());
    let found = boundary.locate(&points, blocks.clone(), rest);
    assert_eq!(found, Some((pair, [0.75, 0.0])));
    // Not on the other block.
    let [own, other] = blocks;
    assert_eq!(boundary.locate(&points, [other, own], rest), None);
}

#[test]
fn material_points_on_a_triangle_are_found_again() {
    let (mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.5, 1.0, 2.0]));
    let rest = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP], &space::SIDE);
    let foot = [0.25, 0.5];
    let points = boundary.material_points(pair, &foot, rest);
    assert_eq!(points[0].position, [0.5, 1.0, 2.0]);
    let expected = foot_point(&boundary, pair.target, &mesh.nodes, foot);
    assert_close(points[1].position, expected);
    assert_eq!(points[1].outward, [0.0, 0.0, 1.0]);
    let kinds = points.map(|point| point.kind);
    assert_eq!(kinds, [FeatureKind::Vertex, FeatureKind::Face]);
    let blocks = [1, 0].map(|block: usize| mesh.blocks[block].nodes.clone());
    let found = boundary.locate(&points, blocks, rest);
    assert_eq!(found.map(|(pair, _)| pair), Some(pair));
    assert_close(found.expect("a value").1, foot);
}

#[test]
fn material_points_on_edges_are_found_again() {
    let (mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 0.25]));
    let rest = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
    let points = boundary.material_points(pair, &[0.75, 0.25], rest);
    let positions = points.map(|point| point.position);
    assert_eq!(positions, [[0.0; 3], [0.0, 0.5, 0.25]]);
    let directions = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    assert_eq!(
        points.map(|point| point.kind),
        directions.map(FeatureKind::Edge)
    );
    let blocks = [0, 1].map(|block: usize| mesh.blocks[block].nodes.clone());
    let found = boundary.locate(&points, blocks, rest);
    assert_eq!(found, Some((pair, [0.75, 0.25])));
}

#[test]
fn a_contact_in_the_plane_has_its_type_and_half_of_the_common_length() {
    let classified = |x: f64| {
        let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([x, -0.75 * x]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
        boundary.classify(pair, at, TOLERANCE)
    };
    assert_eq!(classified(1.0), (ContactKind::VertexEdge, 0.0));
    assert_eq!(classified(0.0), (ContactKind::VertexVertex, 0.0));
    // The corner (0.5, 1) of the upper square, on the top of the lower one: 0.5 m in common.
    let mesh = mesh(&flush_squares());
    let boundary = Boundary2d::new(&mesh, THICKNESS);
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[4], &[2, 3]);
    let (kind, area) = boundary.classify(pair, at, TOLERANCE);
    assert_eq!(kind, ContactKind::EdgeEdge);
    assert_close([area], [0.25 * THICKNESS]);
}

#[test]
fn a_contact_in_space_has_its_type_and_a_third_of_a_common_triangle() {
    let classified = |place: [f64; 3]| {
        let (mesh, boundary) = over_roof_3d(ROOF, tip_3d(place));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[space::TIP], &space::SIDE);
        boundary.classify(pair, at, TOLERANCE)
    };
    let within = classified([0.5, 1.0, -0.75]);
    assert_eq!(within, (ContactKind::VertexFace, 0.0));
    assert_eq!(classified([0.0; 3]), (ContactKind::VertexEdge, 0.0));
    let at_corner = classified([-1.0, 0.0, 0.0]);
    assert_eq!(at_corner, (ContactKind::VertexVertex, 0.0));
    let (mesh_of_edges, boundary) = over_roof_3d(ROOF, keel([0.0; 3]));
    let at = Configuration::at_rest(&mesh_of_edges.nodes);
    let edges = pair(&boundary, &space::RIDGE, &space::KEEL);
    let crossed = boundary.classify(edges, at, TOLERANCE);
    assert_eq!(crossed, (ContactKind::EdgeEdge, 0.0));
    let mesh = mesh(&flush_tetrahedra());
    let boundary = Boundary3d::new(&mesh, TOLERANCE);
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[4], &[0, 1, 2]);
    let (kind, area) = boundary.classify(pair, at, TOLERANCE);
    assert_eq!(kind, ContactKind::FaceFace);
    assert_close([area], [0.5 / 3.0]);
}
