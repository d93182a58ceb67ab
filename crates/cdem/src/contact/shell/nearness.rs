//! Which pairs their surroundings keep apart, and for how long.
//!
//! A corner in front of a face may touch it only if no edge of the corner leads into
//! the block behind the face; two edges may only if they are sharp, and no face beside
//! one leads into the other's block. What keeps a pair apart turns as nodes move: with s
//! the smallest length that bears on it, by no more than a few times their way over s.
//! So each pair has a length by which its nodes must have moved against each other
//! before it may touch.

use super::Shell;
use super::crossing::distance;
use crate::contact::surface::{FLUSH, Nearness, Positions};
use crate::vector::{dot, norm};

/// Turn of a vertex's edges against a triangle, and of faces against the normal of two
/// edges, rad, at first order, for a motion of all nodes by their size: either end of
/// each may move either way.
const TURNS: f64 = 4.0;
const TURNS_OF_EDGES: f64 = 8.0;

/// The same of what says on which side of an edge the other's block lies: the normals
/// beside both, added up.
const TURNS_OF_SIDES: f64 = 16.0;

impl Shell {
    /// Of a vertex no farther from a triangle than reach and tolerance, about.
    pub(super) fn nearness_facing(
        &self,
        vertex: u32,
        triangle: u32,
        at: Positions<3>,
        (reach, tolerance): (f64, f64),
    ) -> Nearness {
        let range = reach.max(tolerance);
        let facing = self.facing(vertex, triangle, at);
        if facing.gap > range || facing.gap < -range - tolerance || facing.outside().1 > range {
            return Nearness::Apart;
        }
        let edges = self.skin.edges_at(vertex).iter();
        let lengths = edges.map(|&edge| self.length(edge, at));
        let smallest = lengths.chain(facing.heights).fold(f64::MAX, f64::min);
        let turn = -self.lowest_edge(vertex, &facing.normal, at) - FLUSH;
        Nearness::until_turned(turn * smallest / TURNS, (reach, tolerance))
    }

    /// Of two edges.
    pub(super) fn nearness_crossing(
        &self,
        edges: [u32; 2],
        at: Positions<3>,
        (reach, tolerance): (f64, f64),
    ) -> Nearness {
        let [main, target] = edges.map(|edge| self.skin.edge(edge, at));
        if distance(&main, &target) > reach.max(tolerance) + tolerance {
            return Nearness::Apart;
        }
        let sharpens = edges.map(|edge| self.skin.sharpens_after(edge, at));
        let sharpens = f64::max(sharpens[0], sharpens[1]);
        if reach <= sharpens {
            return Nearness::Lacks(sharpens);
        }
        let Some(crossing) = self.crossing(edges[0], edges[1], at) else {
            return Nearness::Near;
        };
        let smallest = edges.map(|edge| {
            self.length(edge, at)
                .min(self.skin.ridge(edge, at).least_height)
        });
        let smallest = crossing.sine * f64::min(smallest[0], smallest[1]);
        let turn = -self.lowest_side(edges, &crossing.normal, at) - FLUSH;
        let turn = f64::min(turn / TURNS_OF_EDGES, crossing.outward / TURNS_OF_SIDES);
        Nearness::until_turned(turn * smallest, (reach, tolerance))
    }

    /// The lowest an edge from a vertex leads over a plane with this normal: the sine
    /// of its angle with it.
    pub(super) fn lowest_edge(&self, vertex: u32, normal: &[f64; 3], at: Positions<3>) -> f64 {
        let edges = self.skin.edges_at(vertex).iter();
        let heights = edges.map(|&edge| {
            let away = self.skin.away(vertex, edge, at);
            dot(&away, normal) / norm(&away)
        });
        heights.fold(f64::MAX, f64::min)
    }

    /// The lowest a face beside a main edge leads over a plane with this normal, or one
    /// beside a target edge under it: the sine of its angle with it.
    pub(super) fn lowest_side(&self, edges: [u32; 2], normal: &[f64; 3], at: Positions<3>) -> f64 {
        let of = |(edge, sign): (u32, f64)| {
            let sides = self.skin.directions_into_sides(edge, at);
            let heights = sides.into_iter().flatten();
            heights.map(move |into| sign * dot(&into, normal))
        };
        let both = edges.into_iter().zip([1.0, -1.0]);
        both.flat_map(of).fold(f64::MAX, f64::min)
    }
}

impl Nearness {
    /// Of a pair that cannot touch before its nodes have moved by `turned` against each
    /// other, m; ≤ 0 where nothing is to turn.
    fn until_turned(turned: f64, (reach, tolerance): (f64, f64)) -> Self {
        if reach.max(tolerance) >= turned {
            Self::Near
        } else {
            // Whatever the reach then: what touches at a corner may do so with any
            // feature there within the tolerance.
            Self::Lacks(turned - tolerance)
        }
    }
}
