//! Pairs whose orientation rules out contact, and the motion for which it does.
//!
//! A corner in front of a face may touch it only if no edge of the corner leads into the block
//! behind the face. Two edges may touch only if they are sharp, and no face beside one leads into
//! the other's block. These directions turn as nodes move: with s the smallest length involved, by
//! no more than a few times their travel over s. So each pair has a length by which its nodes must
//! have moved against each other before it may touch.

use crate::contact::narrow_phase::edge_edge::distance;
use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Configuration, CullingRange, CullingResult, Pair};
use crate::contact::tolerances::{EDGE_TURN_RATE, FACE_TURN_RATE, FLUSH, SIDE_TURN_RATE};
use crate::math::vector::{norm, sub};

impl Boundary3d {
    /// Tests a vertex no farther from a triangle than about the motion and the tolerance.
    pub(crate) fn cull_point_triangle(
        &self,
        pair: Pair,
        at: Configuration<3>,
        range: CullingRange,
    ) -> CullingResult {
        let CullingRange { motion, tolerance } = range;
        let (vertex, far) = (pair.main, motion.max(tolerance));
        let facing = self.point_triangle(vertex, pair.target, at);
        if facing.gap > far || facing.gap < -far - tolerance || facing.foot_distance().1 > far {
            return CullingResult::Far;
        }
        let edges = self.triangulation.edges_at(vertex).iter();
        let lengths = edges.map(|&edge| self.length(edge, at));
        let smallest = lengths.chain(facing.heights).fold(f64::MAX, f64::min);
        let turn = -self.least_cone_margin_at_vertex(vertex, &facing.normal, at) - FLUSH;
        until_turned(turn * smallest / FACE_TURN_RATE, range)
    }

    /// Tests two edges no farther from each other than about the motion and the tolerance.
    pub(crate) fn cull_edge_edge(
        &self,
        edges: [u32; 2],
        at: Configuration<3>,
        range: CullingRange,
    ) -> CullingResult {
        let CullingRange { motion, tolerance } = range;
        let [main, target] = edges.map(|edge| self.triangulation.edge(edge, at));
        if distance(&main, &target) > motion.max(tolerance) + tolerance {
            return CullingResult::Far;
        }
        let lengths = [target, main].map(|[a, b]| norm(&sub(&b, &a)));
        let sharpens = |k: usize| self.triangulation.sharpens_after(edges[k], lengths[k], at);
        let sharpens = f64::max(sharpens(0), sharpens(1));
        if motion <= sharpens {
            return CullingResult::ExcludedUntil(sharpens);
        }
        let Some(crossing) = self.edge_edge(edges[0], edges[1], at) else {
            return CullingResult::Near;
        };
        let smallest = edges.map(|edge| self.triangulation.edge_shape(edge, at).least_height);
        let smallest = crossing.sine * f64::min(smallest[0], smallest[1]);
        let turn = -self.least_cone_margin_at_edges(edges, &crossing.normal, at) - FLUSH;
        let turn = f64::min(turn / EDGE_TURN_RATE, crossing.outward / SIDE_TURN_RATE);
        until_turned(turn * smallest, range)
    }
}

/// Returns the result for a pair that cannot touch before the travels of its nodes add up to
/// `turned`, m; ≤ 0 if nothing must turn.
fn until_turned(turned: f64, range: CullingRange) -> CullingResult {
    let CullingRange { motion, tolerance } = range;
    if motion.max(tolerance) >= turned {
        CullingResult::Near
    } else {
        // Whatever the motion is later: a touch at a corner may belong to any feature there within
        // the tolerance.
        CullingResult::ExcludedUntil(turned - tolerance)
    }
}
