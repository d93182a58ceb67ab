//! What contact needs to know of the blocks' surfaces, in any dimension.

pub(crate) mod boundary_2d;
pub(crate) mod boundary_3d;
pub(crate) mod configuration;
pub(crate) mod contact_kind;
pub(crate) mod geometry_cache;
pub(crate) mod material_point;
#[cfg(test)]
mod material_point_tests;
pub(crate) mod triangulation;

use std::ops::Range;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use crate::contact::ccd::signed_volume::Slack;
use crate::contact::detection::grid::Aabb;
pub(crate) use crate::contact::surface::configuration::Configuration;
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::geometry_cache::Formed;
use crate::math::vector::{add_scaled, dot, norm};

/// Nodes that a contact constraint touches at most: two edges, each from a
/// corner of a quadrilateral to the mean of its four.
pub(crate) const MAX_NODES: usize = 8;

/// Sine of the angle up to which two features count as flush and a vertex as
/// lying inside a flat boundary.
///
/// A corner drawn a length s into its face, as for shrunken edges, stays in the plane
/// of contact to within the tolerance d where the sine is d/s or less: this is
/// s = 50 d, by default a 200th of the smallest edge. It must be above the angle that
/// d hides over such an edge, 1e-4, and the rotations of small strain, 1e-2; and below
/// turns that are meant, as of a circle of 300 edges. It names contacts and breaks ties
/// among what touches within d anyway: half of it and twice as much give the same bounces
/// of the six types, to all digits printed, and motion does not jump where a tilt
/// passes it (`crates/cdem-verify/tests/solid/tilt.rs`).
pub(crate) const FLUSH: f64 = 0.02;

/// Relative round-off of a foot's parameters on its target.
pub(crate) const FOOT_ROUND_OFF: f64 = 1e-9;

/// Most of what is [beyond a re-entrant edge](beyond_reentrant), over the depth.
pub(crate) const FARTHEST_BEYOND: f64 = 1.0 / FLUSH;

/// How far beyond an edge that turns by this angle, rad, a point may be that touches the
/// face on its other side, no deeper than `depth` in that on its own; 0 where it is convex.
/// In its plane it is beyond the edge by its depth over the sine of the turn; where both
/// faces are flush and one contact, as deep in both, by that times half the turn.
pub(crate) fn beyond_reentrant(turn: f64, depth: f64) -> f64 {
    if turn < -FLUSH {
        depth / (-turn).sin().max(FLUSH)
    } else {
        depth * (-turn).max(0.0)
    }
}

/// Whether two features may touch within some reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Nearness {
    /// They may.
    Near,
    /// They are too far from each other, at least by a little.
    Apart,
    /// They may not for how they lie, as long as the reach and [`STEEP`] times the ways
    /// of both blocks' nodes since are less than this together, m.
    Lacks(f64),
}

/// How much faster than the ways of both blocks together what a pair lacks may shrink:
/// by 1 in front of faces, 1.1 and 1.75 between edges (`shell::nearness`), 1.3 where
/// edges sharpen, all at first order. It ends before nodes have moved by a 16th of the
/// smallest length that bears on it, within which the rest is far less.
pub(crate) const STEEP: f64 = 4.0;

/// A main feature against a target feature: in 2-D a vertex and an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct Pair {
    /// Number of the main feature.
    pub(crate) main: u32,
    /// Number of the target feature.
    pub(crate) target: u32,
}

/// Pairs around one point: as many as there mostly are take no memory of their own.
pub(super) type Pairs = SmallVec<[Pair; 16]>;

/// Where the main point lies with respect to its target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// Signed distance along the normal, m; negative inside the target.
    pub(crate) gap: f64,
    /// Parameters of the foot point on the target.
    pub(crate) foot: [f64; 2],
    /// How far the foot lies outside the target feature, m; ≤ 0 within it.
    pub(crate) outside: f64,
}

/// Relative velocity of the two points of a contact as a linear map of nodal
/// velocities, row by row: normal first, then the tangents.
///
/// The target's velocity is that of its material *at the main point*, rotation
/// of the feature included; impulses act by the transpose, so that neither
/// momentum changes at any gap (design, section 5).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Operator<const D: usize> {
    /// Nodes in use.
    pub(crate) count: usize,
    /// Their numbers.
    pub(crate) nodes: [u32; MAX_NODES],
    /// `rows[k][r]`: what node k's velocity adds to row r.
    pub(crate) rows: [[[f64; D]; D]; MAX_NODES],
    /// Row vectors in space: normal, then tangents.
    pub(crate) frame: [[f64; D]; D],
    /// Offset main point − anchored target point in the frame, m.
    pub(crate) offset: [f64; D],
}

impl<const D: usize> Default for Operator<D> {
    /// Of no nodes.
    fn default() -> Self {
        Self {
            count: 0,
            nodes: [0; MAX_NODES],
            rows: [[[0.0; D]; D]; MAX_NODES],
            frame: [[0.0; D]; D],
            offset: [0.0; D],
        }
    }
}

impl<const D: usize> Operator<D> {
    /// The nodes in use.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Relative velocity of row `r`, m/s.
    pub(crate) fn relative_velocity(&self, r: usize, velocity: &[[f64; D]]) -> f64 {
        let nodes = self.nodes().iter().enumerate();
        nodes
            .map(|(k, &node)| dot(&self.rows[k][r], &velocity[node as usize]))
            .sum()
    }

    /// Relative velocity of all rows, m/s.
    pub(crate) fn relative_velocities(&self, velocity: &[[f64; D]]) -> [f64; D] {
        let mut relative = [0.0; D];
        for (&node, rows) in self.nodes().iter().zip(&self.rows) {
            let velocity = &velocity[node as usize];
            for r in 0..D {
                relative[r] += dot(&rows[r], velocity);
            }
        }
        relative
    }

    /// Calls `receive` with the impulse on each node, N·s, of one in the frame.
    pub(crate) fn deliver(&self, impulse: &[f64; D], mut receive: impl FnMut(u32, &[f64; D])) {
        for (&node, rows) in self.nodes().iter().zip(&self.rows) {
            let mut on = [0.0; D];
            for r in 0..D {
                add_scaled(&mut on, impulse[r], &rows[r]);
            }
            receive(node, &on);
        }
    }
}

/// A material point on a feature, wherever the mesh has its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mark<const D: usize> {
    /// Place at rest, m.
    pub(crate) place: [f64; D],
    /// What kind of feature it is on.
    pub(crate) on: Feature<D>,
    /// Where that looks to at rest: the two lips of a crack are at one place.
    pub(crate) outward: [f64; D],
}

impl<const D: usize> Mark<D> {
    /// Whether what looks to another side than its feature, as the other lip of a crack does.
    pub(super) fn is_unlike(&self, outward: &[f64; D]) -> bool {
        let sizes = norm(&self.outward) * norm(outward);
        dot(&self.outward, outward) < LIKE * sizes
    }
}

/// A kind of feature, at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Feature<const D: usize> {
    Vertex,
    /// Of this unit direction, or the opposite one.
    Edge([f64; D]),
    /// In the plane an edge.
    Face,
}

/// Cosine between what parts of one feature look to, at least.
const LIKE: f64 = 0.5;

/// Angle at rest, rad, up to which parts of one flat face or straight edge differ; and how
/// far a mark on either lies beside it, over its size.
pub(super) const PART: f64 = 1e-6;

/// The surfaces of all blocks: features, and the geometry of their pairs.
pub(crate) trait Surface<const D: usize>: Send + Sync {
    /// Nodes of a main feature.
    fn main_nodes(&self, main: u32) -> &[u32];
    /// Nodes of a target feature.
    fn target_nodes(&self, target: u32) -> &[u32];
    /// Room for what so many `pairs` have in common of it at some positions, if that pays: `old`
    /// room of this surface, emptied, is used in any case. What is asked with that has the same
    /// bits.
    fn form(&self, _pairs: usize, _old: Option<Formed<D>>) -> Option<Formed<D>> {
        None
    }
    /// Numbers of the main and of the target features that are looked at against
    /// each other, family by family.
    fn families(&self) -> Vec<[Range<u32>; 2]>;
    /// Box around a main feature, grown by the `margin` that its nodes may move, m; empty
    /// where nothing can touch it until then.
    fn main_box(&self, main: u32, at: Configuration<D>, margin: f64) -> Aabb<D> {
        let nodes = self.main_nodes(main).iter();
        Aabb::around(nodes.map(|&node| at.at(node)), margin)
    }
    /// The same around a target feature.
    fn target_box(&self, target: u32, at: Configuration<D>, margin: f64) -> Aabb<D> {
        let nodes = self.target_nodes(target).iter();
        Aabb::around(nodes.map(|&node| at.at(node)), margin)
    }
    /// Whether a pair of a family is one to look at: where either feature could be
    /// the main one, only one of the two ways is.
    fn matches(&self, _pair: Pair) -> bool {
        true
    }
    /// Distance between the features of a pair, m, or less: never more, and it
    /// changes by no more than the nodes of both features move.
    fn apart(&self, pair: Pair, at: Configuration<D>) -> f64 {
        let main = self.main_box(pair.main, at, 0.0);
        main.apart(&self.target_box(pair.target, at, 0.0))
    }
    /// Whether a relative motion of `reach` may make the two touch; `tolerance`
    /// is what they may lie in each other. Only asked of features no farther
    /// [`apart`](Self::apart) than 1.5 of both together.
    fn nearness(&self, pair: Pair, at: Configuration<D>, reach: f64, tolerance: f64) -> Nearness {
        let projection = self.project(pair, at);
        let depth = reach + tolerance;
        if projection.gap <= reach && projection.gap >= -depth && projection.outside <= reach {
            Nearness::Near
        } else {
            Nearness::Apart
        }
    }
    /// Whether a pair that touches at rest presses. Edges within a flat face do not
    /// as long as it is flat; nor do corners and edges that only just meet, as those
    /// of stones side by side and one above the other: it takes a motion to say
    /// which way.
    fn presses(&self, _pair: Pair, _at: Configuration<D>, _tolerance: f64) -> bool {
        true
    }
    /// Whether a point has two contacts, as in a re-entrant corner, whose sides face
    /// each other: neither leaves nothing to the other.
    fn both_bear(&self, one: Pair, other: Pair, at: Configuration<D>) -> bool;
    /// Where the main point lies with respect to the target.
    fn project(&self, pair: Pair, at: Configuration<D>) -> Projection;
    /// Gap of a pair whose normal, out of the target, goes the way of `along`, m; `None` for
    /// parallel edges.
    fn gap(&self, pair: Pair, at: Configuration<D>, _along: &[f64; D]) -> Option<f64> {
        let projection = self.project(pair, at);
        projection.outside.is_finite().then_some(projection.gap)
    }
    /// Unit normal of a contact, out of the target; `None` for parallel edges.
    fn normal(&self, pair: Pair, at: Configuration<D>) -> Option<[f64; D]>;
    /// Whether the target's inward normal lies in the main feature's normal
    /// cone: without it, flush corners press sideways (design, section 4.3).
    fn admits(&self, pair: Pair, at: Configuration<D>) -> bool;
    /// Size of the target feature, m.
    fn target_size(&self, target: u32, at: Configuration<D>) -> f64;
    /// Earliest touch within `duration` at constant velocities: of what is in front, or
    /// comes in, moving farther in, no deeper than `depth` inside.
    fn time_of_impact(
        &self,
        pair: Pair,
        at: Configuration<D>,
        velocity: &[[f64; D]],
        duration: f64,
        depth: f64,
    ) -> Option<f64>;
    /// Whether the features of a pair may be such that they touch in a drift from `at` to its
    /// `end`, at a glance: edges within flat faces are not.
    fn may_touch(&self, _pair: Pair, _at: Configuration<D>, _end: Configuration<D>) -> bool {
        true
    }
    /// Whether a pair that touches, within some slack, stays as it is for `duration` at
    /// constant velocities, within some too; never, if it might not. Or whether it is clear
    /// of its target by so much that it waits: parallel edges, whose gap says nothing, are
    /// wherever a pair can be.
    fn rests(
        &self,
        pair: Pair,
        at: Configuration<D>,
        velocity: &[[f64; D]],
        duration: f64,
        slack: Slack,
    ) -> bool;
    /// The pairs of all features around the point of a pair, within `tolerance`, which may
    /// touch there as well; of a point in the middle of a feature none but the pair itself.
    fn beside(&self, pair: Pair, at: Configuration<D>, tolerance: f64) -> Pairs;
    /// The target feature on which a point goes on that has left this one.
    fn neighbour(&self, pair: Pair, foot: &[f64; 2], at: Configuration<D>) -> Option<Pair>;
    /// The pair that goes on bearing where the point of one has left its features by more
    /// than the tolerance, and whether its main block is the other's target: of an edge that
    /// slides lengthwise off one it lies on flush, its end.
    fn successor(
        &self,
        _pair: Pair,
        _at: Configuration<D>,
        _tolerance: f64,
    ) -> Option<(Pair, bool)> {
        None
    }
    /// Whether two pairs say the same: one physical contact is counted once.
    fn same_contact(&self, one: Pair, other: Pair, at: Configuration<D>, tolerance: f64) -> bool;
    /// The point of contact on the main feature, m.
    fn point(&self, pair: Pair, at: Configuration<D>) -> [f64; D] {
        at.at(self.main_nodes(pair.main)[0])
    }
    /// Makes an operator that of the relative motion of the pair with the target point anchored
    /// at `foot`, its normal going the way of `along`, if that is known. In place: operators
    /// are large, and kept where solvers find them.
    fn relate(
        &self,
        operator: &mut Operator<D>,
        pair: Pair,
        foot: &[f64; 2],
        at: Configuration<D>,
        along: Option<&[f64; D]>,
    );
    /// A new one, whose normal goes the way that the surface says.
    fn operator(&self, pair: Pair, foot: &[f64; 2], at: Configuration<D>) -> Operator<D> {
        let mut operator = Operator::default();
        self.relate(&mut operator, pair, foot, at, None);
        operator
    }
    /// Where the points of a pair with this `foot` are: on the main and on the target.
    fn marks(&self, pair: Pair, foot: &[f64; 2], rest: Configuration<D>) -> [Mark<D>; 2];
    /// The pair with its points there, on blocks of these nodes, and its foot.
    fn at_marks(
        &self,
        marks: &[Mark<D>; 2],
        nodes: [Range<u32>; 2],
        rest: Configuration<D>,
    ) -> Option<(Pair, [f64; 2])>;
    /// Configuration of the two blocks at the pair, and its tributary area, m².
    fn classify(&self, pair: Pair, at: Configuration<D>, tolerance: f64) -> (ContactKind, f64);
}
