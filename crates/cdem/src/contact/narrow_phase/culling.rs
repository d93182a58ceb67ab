//! Pairs whose orientation rules out contact, and the motion for which it does.
//!
//! A corner in front of a face may touch it only if no edge of the corner leads into the block
//! behind the face. Two edges may touch only if they are sharp, and no face beside one leads into
//! the other's block. These directions turn as nodes move: with s the smallest length involved, by
//! no more than a few times their travel over s. So each pair has a length by which its nodes must
//! have moved against each other before it may touch.

use crate::contact::surface::boundary_3d::Boundary3d;
use crate::contact::surface::{Configuration, Pair};
use crate::contact::tolerances::{EDGE_TURN_RATE, FACE_TURN_RATE, FLUSH, SIDE_TURN_RATE};
use crate::math::vector::{norm, sub};

// A touch at a corner may belong to any feature there within the contact resolution, so all
// lengths are shorter by it.
impl Boundary3d {
    /// Returns the exclusion length of a vertex and a triangle, m.
    pub(crate) fn exclusion_of_point(
        &self,
        pair: Pair,
        at: Configuration<3>,
        resolution: f64,
    ) -> f64 {
        let vertex = pair.main;
        let facing = self.point_triangle(vertex, pair.target, at);
        let edges = self.triangulation.edges_at(vertex).iter();
        let lengths = edges.map(|&edge| self.length(edge, at));
        let smallest = lengths.chain(facing.heights).fold(f64::MAX, f64::min);
        let turn = -self.least_cone_margin_at_vertex(vertex, &facing.normal, at) - FLUSH;
        turn * smallest / FACE_TURN_RATE - resolution
    }

    /// Returns the exclusion length of two edges, m.
    pub(crate) fn exclusion_of_edges(
        &self,
        edges: [u32; 2],
        at: Configuration<3>,
        resolution: f64,
    ) -> f64 {
        let [main, target] = edges.map(|edge| self.triangulation.edge(edge, at));
        let lengths = [target, main].map(|[a, b]| norm(&sub(&b, &a)));
        let sharpens = |k: usize| self.triangulation.sharpens_after(edges[k], lengths[k], at);
        let sharpens = f64::max(sharpens(0), sharpens(1));
        // Nothing must turn for parallel edges, and little for nearly parallel ones.
        let turned = self
            .edge_edge(edges[0], edges[1], at)
            .map_or(0.0, |crossing| {
                let smallest =
                    edges.map(|edge| self.triangulation.edge_shape(edge, at).least_height);
                let smallest = crossing.sine * f64::min(smallest[0], smallest[1]);
                let smallest = f64::max(smallest - resolution, 0.0);
                let turn = -self.least_cone_margin_at_edges(edges, &crossing.normal, at) - FLUSH;
                smallest * f64::min(turn / EDGE_TURN_RATE, crossing.outward / SIDE_TURN_RATE)
            });
        sharpens.max(turned - resolution)
    }
}
