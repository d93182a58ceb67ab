//! The four questions that contact asks a boundary, in any dimension.

use std::ops::Range;

use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::configuration::Configuration;
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::geometry_cache::GeometryCache;
use crate::contact::surface::jacobian::ContactJacobian;
use crate::contact::surface::material_point::MaterialPoint;
use crate::contact::surface::{CullingResult, GapAllowance, Pair, Pairs, Projection};

/// Features of the boundaries of all blocks, by number.
pub(crate) trait Topology<const D: usize>: Send + Sync {
    /// Nodes of a main feature.
    fn main_nodes(&self, main: u32) -> &[u32];
    /// Nodes of a target feature.
    fn target_nodes(&self, target: u32) -> &[u32];
    /// Room for what so many `pairs` have in common of it at some positions, if that pays: `old`
    /// room of this surface, emptied, is used in any case. What is asked with that has the same
    /// bits.
    fn geometry_cache(
        &self,
        _pairs: usize,
        _old: Option<GeometryCache<D>>,
    ) -> Option<GeometryCache<D>> {
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
    fn is_canonical(&self, _pair: Pair) -> bool {
        true
    }
}

/// Distances, normals and normal cones of feature pairs: the narrow phase.
pub(crate) trait Distance<const D: usize>: Topology<D> {
    /// Distance between the features of a pair, m, or less: never more, and it
    /// changes by no more than the nodes of both features move.
    fn distance_lower_bound(&self, pair: Pair, at: Configuration<D>) -> f64 {
        let main = self.main_box(pair.main, at, 0.0);
        main.apart(&self.target_box(pair.target, at, 0.0))
    }
    /// Whether a relative motion of `reach` may make the two touch; `tolerance`
    /// is what they may lie in each other. Only asked of features no farther
    /// [that bound](Self::distance_lower_bound) than 1.5 of both together.
    fn cull(&self, pair: Pair, at: Configuration<D>, reach: f64, tolerance: f64) -> CullingResult {
        let projection = self.project(pair, at);
        let depth = reach + tolerance;
        if projection.gap <= reach && projection.gap >= -depth && projection.outside <= reach {
            CullingResult::Near
        } else {
            CullingResult::Apart
        }
    }
    /// Whether a pair that touches at rest presses. Edges within a flat face do not
    /// as long as it is flat; nor do corners and edges that only just meet, as those
    /// of stones side by side and one above the other: it takes a motion to say
    /// which way.
    fn can_transmit_load(&self, _pair: Pair, _at: Configuration<D>, _tolerance: f64) -> bool {
        true
    }
    /// Whether a point has two contacts, as in a re-entrant corner, whose sides face
    /// each other: neither leaves nothing to the other.
    fn is_reentrant_pair(&self, one: Pair, other: Pair, at: Configuration<D>) -> bool;
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
    fn in_normal_cone(&self, pair: Pair, at: Configuration<D>) -> bool;
    /// Size of the target feature, m.
    fn target_size(&self, target: u32, at: Configuration<D>) -> f64;
    /// Whether two pairs say the same: one physical contact is counted once.
    fn same_contact(&self, one: Pair, other: Pair, at: Configuration<D>, tolerance: f64) -> bool;
    /// The point of contact on the main feature, m.
    fn point(&self, pair: Pair, at: Configuration<D>) -> [f64; D] {
        at.at(self.main_nodes(pair.main)[0])
    }
}

/// Times of impact of feature pairs at constant velocities: continuous collision detection.
pub(crate) trait TimeOfImpact<const D: usize>: Topology<D> {
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
    fn may_touch_in_drift(
        &self,
        _pair: Pair,
        _at: Configuration<D>,
        _end: Configuration<D>,
    ) -> bool {
        true
    }
    /// Whether a pair that touches, within some slack, stays as it is for `duration` at
    /// constant velocities, within some too; never, if it might not. Or whether it is clear
    /// of its target by so much that it waits: parallel edges, whose gap says nothing, are
    /// wherever a pair can be.
    fn stays_in_contact(
        &self,
        pair: Pair,
        at: Configuration<D>,
        velocity: &[[f64; D]],
        duration: f64,
        slack: GapAllowance,
    ) -> bool;
}

/// Geometry of a contact point while it lasts: neighbours, Jacobian, material points, type.
pub(crate) trait ContactGeometry<const D: usize>: Distance<D> {
    /// The pairs of all features around the point of a pair, within `tolerance`, which may
    /// touch there as well; of a point in the middle of a feature none but the pair itself.
    fn adjacent_pairs(&self, pair: Pair, at: Configuration<D>, tolerance: f64) -> Pairs;
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
    /// Makes an operator that of the relative motion of the pair with the target point anchored
    /// at `foot`, its normal going the way of `along`, if that is known. In place: operators
    /// are large, and kept where solvers find them.
    fn assemble_jacobian(
        &self,
        jacobian: &mut ContactJacobian<D>,
        pair: Pair,
        foot: &[f64; 2],
        at: Configuration<D>,
        along: Option<&[f64; D]>,
    );
    /// A new one, whose normal goes the way that the surface says.
    fn jacobian(&self, pair: Pair, foot: &[f64; 2], at: Configuration<D>) -> ContactJacobian<D> {
        let mut jacobian = ContactJacobian::default();
        self.assemble_jacobian(&mut jacobian, pair, foot, at, None);
        jacobian
    }
    /// Where the points of a pair with this `foot` are: on the main and on the target.
    fn material_points(
        &self,
        pair: Pair,
        foot: &[f64; 2],
        rest: Configuration<D>,
    ) -> [MaterialPoint<D>; 2];
    /// The pair with its points there, on blocks of these nodes, and its foot.
    fn locate(
        &self,
        marks: &[MaterialPoint<D>; 2],
        nodes: [Range<u32>; 2],
        rest: Configuration<D>,
    ) -> Option<(Pair, [f64; 2])>;
    /// Configuration of the two blocks at the pair, and its tributary area, m².
    fn classify(&self, pair: Pair, at: Configuration<D>, tolerance: f64) -> (ContactKind, f64);
}

/// The boundaries of all blocks.
pub(crate) trait Surface<const D: usize>: TimeOfImpact<D> + ContactGeometry<D> {}

impl<const D: usize, T: TimeOfImpact<D> + ContactGeometry<D>> Surface<D> for T {}
