//! Tests of [`Distance`](crate::contact::surface::Distance).

use super::{
    FLAT, ROOF, TOLERANCE, VALLEY, assert_close, assert_projection, foot_point, keel, over_roof_2d,
    over_roof_3d, pair, plane, space, tip_2d, tip_3d,
};
use crate::contact::narrow_phase::feature_selection::{are_one_contact, has_one_normal};
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Configuration, Distance};
use crate::mesh::Mesh;

#[test]
fn a_vertex_in_the_plane_is_projected_on_an_edge() {
    // On the right side: 4 m of 5 m along it from its start, and 0.25 m above it.
    let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([0.8 + 0.15, -0.6 + 0.2]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    let projection = boundary.project(pair, at);
    assert_projection(projection, 0.25, -1.0);
    assert_close(projection.foot, [0.8, 0.0]);
    let along = [0.0, 1.0];
    assert_close(
        [boundary.gap(pair, at, Some(&along)).expect("a gap")],
        [0.25],
    );
    assert_close(boundary.normal(pair, at).expect("a normal"), [0.6, 0.8]);
    assert_close([boundary.target_size(pair.target, at)], [5.0]);
    assert_eq!(boundary.point(pair, at), [0.8 + 0.15, -0.6 + 0.2]);
}

#[test]
fn a_vertex_in_space_is_projected_on_a_triangle() {
    // The foot is (0.5, 1, -0.75), the gap 0.25 m along (0, 3, 4)/5.
    let (mesh, boundary) = over_roof_3d(ROOF, tip_3d([0.5, 1.15, -0.55]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP], &space::SIDE);
    let projection = boundary.project(pair, at);
    let foot = foot_point(&boundary, pair.target, &mesh.nodes, projection.foot);
    assert_close(foot, [0.5, 1.0, -0.75]);
    assert_close([projection.gap], [0.25]);
    let along = [0.0, 0.0, 1.0];
    assert_close(
        [boundary.gap(pair, at, Some(&along)).expect("a gap")],
        [0.25],
    );
    assert_close(
        boundary.normal(pair, at).expect("a normal"),
        [0.0, 0.6, 0.8],
    );
    // The edge from (3, 0, 0) to (0, 4, -3) is the longest.
    assert_close([boundary.target_size(pair.target, at)], [f64::sqrt(34.0)]);
    assert_eq!(boundary.point(pair, at), [0.5, 1.15, -0.55]);
}

#[test]
fn a_foot_beyond_the_ridge_is_outside_by_its_distance_there() {
    let (mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.5, -0.5, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP], &space::SIDE);
    assert_projection(boundary.project(pair, at), 0.25, 0.5);
}

#[test]
fn two_crossed_edges_have_a_gap_and_feet() {
    let (mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.5, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
    let projection = boundary.project(pair, at);
    // 3 m of 4 m along the ridge, 1.5 m of 2 m along the keel.
    assert_close(projection.foot, [0.75, 0.75]);
    assert_projection(projection, 0.25, -0.5);
    // Out of the keel, which is the target.
    assert_close(
        boundary.normal(pair, at).expect("a normal"),
        [0.0, 0.0, -1.0],
    );
    let gaps = [-1.0, 1.0].map(|z| boundary.gap(pair, at, Some(&[0.0, 0.0, z])));
    assert_eq!(gaps, [Some(0.25), Some(-0.25)]);
    assert_close(boundary.point(pair, at), [0.0; 3]);
    assert_eq!(boundary.target_size(pair.target, at), 2.0);
    assert!(boundary.in_normal_cone(pair, at));
}

/// Turns the keel along the ridge, with its ends aside and above it, m. Its faces have a slope of 1.
fn along_ridge(ends: [[f64; 2]; 2]) -> (Mesh<3>, Boundary3d) {
    let (mut mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 0.25]));
    for (node, x, [y, z]) in [(5, -1.0, ends[0]), (6, 1.0, ends[1])] {
        mesh.nodes[node] = [x, y, z];
    }
    for (node, y) in [(7, 4.0), (8, -4.0)] {
        mesh.nodes[node] = [0.0, y, 4.25];
    }
    (mesh, boundary)
}

#[test]
fn edges_aside_by_no_more_than_the_resolution_have_no_normal_and_no_gap() {
    for (aside, are_parallel) in [(0.0, true), (0.9, true), (1.1, false)] {
        let y = 0.5 * aside * TOLERANCE;
        let (mesh, boundary) = along_ridge([[-y, 0.25], [y, 0.25]]);
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
        assert_eq!(boundary.normal(pair, at).is_none(), are_parallel, "{aside}");
        let gap = boundary.gap(pair, at, Some(&[0.0, 0.0, 1.0]));
        assert_eq!(gap.is_none(), are_parallel, "{aside}");
        let outside = boundary.project(pair, at).outside;
        assert_eq!(outside == f64::INFINITY, are_parallel, "{aside}");
        assert_eq!(boundary.normal_separates(pair, at), !are_parallel);
    }
}

#[test]
fn a_normal_of_edges_that_leaves_their_cones_does_not_separate() {
    // The normal leans farther than those of the roof, by a fifth, or less far.
    for (rise, separates) in [(0.9, false), (0.6, true)] {
        let (mesh, boundary) = along_ridge([[-0.1, 0.25 - 0.1 * rise], [0.1, 0.25 + 0.1 * rise]]);
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
        assert_eq!(boundary.normal_separates(pair, at), separates);
    }
}

#[test]
fn the_distance_of_a_vertex_in_the_plane_is_that_of_the_nearest_point() {
    // Above the edge; beside its end, 3 m along it and 4 m above it.
    for (place, distance) in [([1.0, 0.25], 0.25), ([-3.0, 4.0], 5.0)] {
        let (mesh, boundary) = over_roof_2d(FLAT, tip_2d(place));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
        assert_eq!(boundary.distance(pair, at), distance);
    }
}

#[test]
fn the_distance_of_a_vertex_in_space_is_that_of_the_nearest_point() {
    // Above the triangle; beside its edge, 0.75 m along it and 1 m above it.
    for (place, distance) in [([0.5, 1.0, 0.25], 0.25), ([0.5, -0.75, 1.0], 1.25)] {
        let (mesh, boundary) = over_roof_3d(FLAT, tip_3d(place));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[space::TIP], &space::SIDE);
        assert_close([boundary.distance(pair, at)], [distance]);
    }
}

#[test]
fn the_distance_of_edges_is_that_of_the_nearest_points() {
    // Across each other; 3 m beyond the end of the ridge and 4 m above it.
    for (place, distance) in [([0.0, 0.0, 0.25], 0.25), ([6.0, 0.0, 4.0], 5.0)] {
        let (mesh, boundary) = over_roof_3d(ROOF, keel(place));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
        assert_close([boundary.distance(pair, at)], [distance]);
    }
}

#[test]
fn a_corner_that_points_away_is_excluded_until_it_has_turned() {
    // An upper corner of the tip lies 0.25 m above the triangle.
    let (mut mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.0, 0.0, 0.0]));
    for node in &mut mesh.nodes[5..] {
        *node = [node[0] + 0.5, node[1] - 3.0, node[2] - 3.75];
    }
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP + 2], &space::SIDE);
    let length = boundary.exclusion(pair, at, TOLERANCE);
    // One edge of the corner falls by 4 m on √32 m, the others are level. The least length is the
    // height of the triangle of 8 m² over its edge of 5 m.
    let sine = std::f64::consts::FRAC_1_SQRT_2 - 0.02;
    assert_close([length], [sine * 3.2 / 4.0 - TOLERANCE]);
}

#[test]
fn a_vertex_in_the_plane_presses_within_an_edge_and_not_at_its_end() {
    for (x, presses) in [(1.0, true), (TOLERANCE, false)] {
        let (mesh, boundary) = over_roof_2d(ROOF, tip_2d([x, -0.75 * x]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
        let found = has_one_normal(&boundary, pair, at, 2.0 * TOLERANCE);
        assert_eq!(found, presses);
    }
}

#[test]
fn a_vertex_in_space_presses_within_a_face_and_not_at_a_ridge() {
    for (place, presses) in [([0.5, 1.0, -0.75], true), ([0.5, 0.0, 0.0], false)] {
        let (mesh, boundary) = over_roof_3d(ROOF, tip_3d(place));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[space::TIP], &space::SIDE);
        assert_eq!(has_one_normal(&boundary, pair, at, TOLERANCE), presses);
    }
}

#[test]
fn crossed_edges_press_if_both_are_sharp() {
    for (height, presses) in [(ROOF, true), (FLAT, false)] {
        let (mesh, boundary) = over_roof_3d(height, keel([0.0, 0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
        assert_eq!(has_one_normal(&boundary, pair, at, TOLERANCE), presses);
    }
}

#[test]
fn both_sides_of_a_valley_in_the_plane_are_a_reentrant_pair() {
    for (height, is_reentrant) in [(VALLEY, true), (FLAT, false), (ROOF, false)] {
        let (mesh, boundary) = over_roof_2d(height, tip_2d([0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let [one, other] = [&plane::LEFT_SIDE, &plane::RIGHT_SIDE]
            .map(|side| pair(&boundary, &[plane::TIP], side));
        assert_eq!(boundary.is_reentrant_pair(one, other, at), is_reentrant);
    }
}

#[test]
fn both_sides_of_a_valley_in_space_are_a_reentrant_pair() {
    for (height, is_reentrant) in [(VALLEY, true), (FLAT, false), (ROOF, false)] {
        let (mesh, boundary) = over_roof_3d(height, tip_3d([0.0, 0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let [one, other] =
            [&space::SIDE, &space::OTHER_SIDE].map(|side| pair(&boundary, &[space::TIP], side));
        assert_eq!(boundary.is_reentrant_pair(one, other, at), is_reentrant);
    }
}

#[test]
fn the_cone_of_a_corner_in_the_plane_holds_normals_up_to_half_a_right_angle() {
    // The normals of the roof lie at 37° to the vertical; those of the steep one at 56°.
    for (height, is_in_cone) in [(ROOF, true), (-6.0, false)] {
        let (mesh, boundary) = over_roof_2d(height, tip_2d([0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
        assert_eq!(boundary.in_normal_cone(pair, at), is_in_cone);
    }
}

#[test]
fn the_cone_of_a_corner_in_space_holds_normals_whose_plane_no_edge_enters() {
    // The edge to (-4, -4, 4) rises over the roof by 4/5, and falls under the steep one.
    for (height, is_in_cone) in [(ROOF, true), (-6.0, false)] {
        let (mesh, boundary) = over_roof_3d(height, tip_3d([0.0, 0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[space::TIP], &space::SIDE);
        assert_eq!(boundary.in_normal_cone(pair, at), is_in_cone);
        // The normal of a face separates all the same.
        assert!(boundary.normal_separates(pair, at));
    }
}

#[test]
fn a_vertex_where_flush_edges_meet_is_one_contact() {
    for (height, is_same) in [(FLAT, true), (ROOF, false)] {
        let (mesh, boundary) = over_roof_2d(height, tip_2d([0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let [one, other] = [&plane::LEFT_SIDE, &plane::RIGHT_SIDE]
            .map(|side| pair(&boundary, &[plane::TIP], side));
        assert_eq!(
            are_one_contact(&boundary, [one, other], [[0, 1]; 2], at, TOLERANCE),
            is_same
        );
    }
}

#[test]
fn a_vertex_where_flush_triangles_meet_is_one_contact() {
    for (height, is_same) in [(FLAT, true), (ROOF, false)] {
        let (mesh, boundary) = over_roof_3d(height, tip_3d([0.0, 0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let [one, other] =
            [&space::SIDE, &space::OTHER_SIDE].map(|side| pair(&boundary, &[space::TIP], side));
        assert_eq!(
            are_one_contact(&boundary, [one, other], [[0, 1]; 2], at, TOLERANCE),
            is_same
        );
    }
}
