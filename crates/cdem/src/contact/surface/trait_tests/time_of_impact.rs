//! Tests of [`TimeOfImpact`](crate::contact::surface::TimeOfImpact).

use super::{
    FLAT, ROOF, TOLERANCE, keel, over_roof_2d, over_roof_3d, pair, plane, space, tip_2d, tip_3d,
    velocities,
};
use crate::contact::surface::{Configuration, ConstantMotion, GapAllowance, TimeOfImpact};

/// Largest margin of round-off before a touch, s: that of the signed volume of lengths of at most
/// 8 m, over its rate.
const EARLY: f64 = 1e-12;

/// Asserts that a time of impact is right, or early by round-off.
#[track_caller]
fn assert_time(found: Option<f64>, expected: f64) {
    let is_right = found.is_some_and(|time| (0.0..=EARLY).contains(&(expected - time)));
    assert!(is_right, "{found:?} is not {expected}");
}

/// Returns the motion of nodes at rest positions.
fn motion<'a, const D: usize>(
    at: Configuration<'a, D>,
    velocity: &'a [[f64; D]],
) -> ConstantMotion<'a, D> {
    ConstantMotion { at, velocity }
}

/// Returns an allowance of gaps up to `within`, m, and of a penetration of one tolerance.
fn allowance(within: f64) -> GapAllowance {
    GapAllowance {
        within,
        depth: TOLERANCE,
    }
}

#[test]
fn a_vertex_in_the_plane_touches_when_its_gap_is_fallen() {
    // 0.25 m at 0.5 m/s.
    let (mesh, boundary) = over_roof_2d(FLAT, tip_2d([1.0, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    let falls = velocities(&mesh, plane::TIP, [0.0, -0.5]);
    assert_time(
        boundary.time_of_impact(pair, motion(at, &falls), 1.0, TOLERANCE),
        0.5,
    );
    let soon = boundary.time_of_impact(pair, motion(at, &falls), 0.4, TOLERANCE);
    assert_eq!(soon, None);
    let rises = velocities(&mesh, plane::TIP, [0.0, 0.5]);
    let never = boundary.time_of_impact(pair, motion(at, &rises), 1.0, TOLERANCE);
    assert_eq!(never, None);
}

#[test]
fn a_vertex_in_the_plane_that_goes_past_the_end_does_not_touch() {
    let (mesh, boundary) = over_roof_2d(FLAT, tip_2d([4.5, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    let falls = velocities(&mesh, plane::TIP, [0.0, -0.5]);
    let found = boundary.time_of_impact(pair, motion(at, &falls), 1.0, TOLERANCE);
    assert_eq!(found, None);
}

#[test]
fn a_vertex_in_space_touches_when_its_gap_is_fallen() {
    let (mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.5, 1.0, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[space::TIP], &space::SIDE);
    let falls = velocities(&mesh, space::TIP, [0.0, 0.0, -0.5]);
    assert_time(
        boundary.time_of_impact(pair, motion(at, &falls), 1.0, TOLERANCE),
        0.5,
    );
    let soon = boundary.time_of_impact(pair, motion(at, &falls), 0.4, TOLERANCE);
    assert_eq!(soon, None);
}

#[test]
fn crossed_edges_touch_when_their_gap_is_fallen() {
    let (mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
    let falls = velocities(&mesh, space::TIP, [0.0, 0.0, -0.5]);
    assert_time(
        boundary.time_of_impact(pair, motion(at, &falls), 1.0, TOLERANCE),
        0.5,
    );
    // It has moved beyond the end of the ridge by then.
    let passes = velocities(&mesh, space::TIP, [-4.0, 0.0, -0.5]);
    let found = boundary.time_of_impact(pair, motion(at, &passes), 1.0, TOLERANCE);
    assert_eq!(found, None);
}

#[test]
fn every_pair_in_the_plane_may_touch_in_a_drift() {
    let (mesh, boundary) = over_roof_2d(FLAT, tip_2d([1.0, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    assert!(boundary.may_touch_in_drift(pair, at, at));
}

#[test]
fn edges_in_a_flat_face_cannot_touch_in_a_drift() {
    for (height, may_touch) in [(ROOF, true), (FLAT, false)] {
        let (mesh, boundary) = over_roof_3d(height, keel([0.0, 0.0, 0.25]));
        let at = Configuration::at_rest(&mesh.nodes);
        let edges = pair(&boundary, &space::RIDGE, &space::KEEL);
        assert_eq!(boundary.may_touch_in_drift(edges, at, at), may_touch);
        let vertex = pair(&boundary, &space::KEEL[..1], &space::OTHER_SIDE);
        assert!(boundary.may_touch_in_drift(vertex, at, at));
    }
}

#[test]
fn a_face_that_bulges_in_the_drift_may_touch_by_its_edge() {
    let (mesh, boundary) = over_roof_3d(FLAT, keel([0.0, 0.0, 0.25]));
    let at = Configuration::at_rest(&mesh.nodes);
    let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
    let mut displacement = vec![[0.0; 3]; mesh.nodes.len()];
    displacement[3] = [0.0, 0.0, 0.1];
    let valley = Configuration::new(&mesh.nodes, &displacement);
    assert!(!boundary.may_touch_in_drift(pair, at, valley));
    displacement[3] = [0.0, 0.0, -0.1];
    let roof = Configuration::new(&mesh.nodes, &displacement);
    assert!(boundary.may_touch_in_drift(pair, at, roof));
}

#[test]
fn a_vertex_in_the_plane_stays_in_contact_unless_it_sinks() {
    for (speed, stays) in [
        (0.0, true),
        (0.5 * TOLERANCE, true),
        (2.0 * TOLERANCE, false),
    ] {
        let (mesh, boundary) = over_roof_2d(FLAT, tip_2d([1.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
        let sinks = velocities(&mesh, plane::TIP, [0.0, -speed]);
        let slack = allowance(10.0 * TOLERANCE);
        let found = boundary.stays_in_contact(pair, motion(at, &sinks), 1.0, slack);
        assert_eq!(found, stays, "{speed}");
    }
}

#[test]
fn a_vertex_in_space_stays_in_contact_unless_it_sinks() {
    for (speed, stays) in [
        (0.0, true),
        (0.5 * TOLERANCE, true),
        (2.0 * TOLERANCE, false),
    ] {
        let (mesh, boundary) = over_roof_3d(FLAT, tip_3d([0.5, 1.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &[space::TIP], &space::SIDE);
        let sinks = velocities(&mesh, space::TIP, [0.0, 0.0, -speed]);
        let slack = allowance(10.0 * TOLERANCE);
        let found = boundary.stays_in_contact(pair, motion(at, &sinks), 1.0, slack);
        assert_eq!(found, stays, "{speed}");
    }
}

#[test]
fn crossed_edges_stay_in_contact_unless_they_sink() {
    for (speed, stays) in [
        (0.0, true),
        (0.5 * TOLERANCE, true),
        (2.0 * TOLERANCE, false),
    ] {
        let (mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, 0.0]));
        let at = Configuration::at_rest(&mesh.nodes);
        let pair = pair(&boundary, &space::RIDGE, &space::KEEL);
        let sinks = velocities(&mesh, space::TIP, [0.0, 0.0, -speed]);
        let slack = allowance(10.0 * TOLERANCE);
        let found = boundary.stays_in_contact(pair, motion(at, &sinks), 1.0, slack);
        assert_eq!(found, stays, "{speed}");
    }
}

#[test]
fn a_gap_above_the_allowance_is_no_contact() {
    let gap = 4.0 * TOLERANCE;
    let slack = allowance(TOLERANCE);
    let (mesh, boundary) = over_roof_2d(FLAT, tip_2d([1.0, gap]));
    let at = Configuration::at_rest(&mesh.nodes);
    let vertex = pair(&boundary, &[plane::TIP], &plane::RIGHT_SIDE);
    let still = velocities(&mesh, plane::TIP, [0.0; 2]);
    assert!(!boundary.stays_in_contact(vertex, motion(at, &still), 1.0, slack));
    let (mesh, boundary) = over_roof_3d(ROOF, keel([0.0, 0.0, gap]));
    let at = Configuration::at_rest(&mesh.nodes);
    let edges = pair(&boundary, &space::RIDGE, &space::KEEL);
    let still = velocities(&mesh, space::TIP, [0.0; 3]);
    assert!(!boundary.stays_in_contact(edges, motion(at, &still), 1.0, slack));
}
