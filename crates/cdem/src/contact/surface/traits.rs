//! The four interfaces of a boundary, in any dimension.

use std::ops::Range;

use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::configuration::Configuration;
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::geometry_cache::GeometryCache;
use crate::contact::surface::jacobian::ContactJacobian;
use crate::contact::surface::kicked::ConstantMotion;
use crate::contact::surface::material_point::MaterialPoint;
use crate::contact::surface::{GapAllowance, JacobianAnchor, Pair, Pairs, Projection};

/// Features of the boundaries of all blocks, by number.
pub(crate) trait Topology<const D: usize>: Send + Sync {
    /// Returns the nodes of a main feature.
    fn main_nodes(&self, main: u32) -> &[u32];
    /// Returns the nodes of a target feature.
    fn target_nodes(&self, target: u32) -> &[u32];
    /// Returns a geometry cache for positions at which this many `pairs` are tested, if it pays. An
    /// `old` cache of this surface is cleared and always used again. Results with a cache have the
    /// same bits as without.
    fn geometry_cache(
        &self,
        _pairs: usize,
        _old: Option<GeometryCache<D>>,
    ) -> Option<GeometryCache<D>> {
        None
    }
    /// Returns the number ranges of main and target features that are tested against each other,
    /// one entry for each family.
    fn families(&self) -> Vec<[Range<u32>; 2]>;
    /// Returns the box around a main feature, m, grown by the `margin` that its nodes may move, m.
    /// The box is empty if nothing can touch the feature until then.
    fn main_box(&self, main: u32, at: Configuration<D>, margin: f64) -> Aabb<D> {
        let nodes = self.main_nodes(main).iter();
        Aabb::around(nodes.map(|&node| at.at(node)), margin)
    }
    /// Returns the box around a target feature, m, in the same way.
    fn target_box(&self, target: u32, at: Configuration<D>, margin: f64) -> Aabb<D> {
        let nodes = self.target_nodes(target).iter();
        Aabb::around(nodes.map(|&node| at.at(node)), margin)
    }
    /// Returns true if a pair of a family is to be tested. If either feature could be the main one,
    /// only one of the two orders is canonical.
    fn is_canonical(&self, _pair: Pair) -> bool {
        true
    }
}

/// Distances, normals and normal cones of feature pairs: the narrow phase.
pub(crate) trait Distance<const D: usize>: Topology<D> {
    /// Returns the distance between the features of a pair, m. It changes by no more than the nodes
    /// of both features move.
    fn distance(&self, pair: Pair, at: Configuration<D>) -> f64;
    /// Returns the exclusion length of a pair, m: its orientation rules out contact while its nodes
    /// move by less against each other. If the nodes of both blocks have travelled by w in all, it
    /// changes by no more than [`CULLING_RATE`](crate::contact::tolerances::CULLING_RATE) w.
    fn exclusion(&self, _pair: Pair, _at: Configuration<D>, _resolution: f64) -> f64 {
        f64::NEG_INFINITY
    }
    /// Returns true if the pairs are the two contacts of one point with the sides of a re-entrant
    /// corner, so that both must be kept.
    fn is_reentrant_pair(&self, one: Pair, other: Pair, at: Configuration<D>) -> bool;
    /// Returns the gap and foot point of the main point on the target.
    fn project(&self, pair: Pair, at: Configuration<D>) -> Projection;
    /// Returns the gap of a pair, m; `None` for parallel edges. The normal is on the side of
    /// `along`, or on the side that the surface gives.
    fn gap(&self, pair: Pair, at: Configuration<D>, _along: Option<&[f64; D]>) -> Option<f64> {
        let projection = self.project(pair, at);
        projection.outside.is_finite().then_some(projection.gap)
    }
    /// Returns the gap of a pair, m; 0 for parallel edges. In space it costs less than the
    /// projection.
    fn gap_or_zero(&self, pair: Pair, at: Configuration<D>) -> f64 {
        self.gap(pair, at, None).unwrap_or(0.0)
    }
    /// Returns the unit normal of a contact, out of the target; `None` for parallel edges.
    fn normal(&self, pair: Pair, at: Configuration<D>) -> Option<[f64; D]>;
    /// Returns true if the normal is in the normal cone of the pair. Without this test, flush
    /// corners press sideways (design, section 4.3).
    fn in_normal_cone(&self, pair: Pair, at: Configuration<D>) -> bool;
    /// Returns true if the normal still separates the two blocks of a contact. A vertex lies on the face
    /// that gives its normal. The common normal of two edges must stay in their normal cones: it
    /// turns fast where they are all but parallel.
    fn normal_separates(&self, _pair: Pair, _at: Configuration<D>) -> bool {
        true
    }
    /// Returns the size of the target feature, m.
    fn target_size(&self, target: u32, at: Configuration<D>) -> f64;
    /// Returns the contact point on the main feature, m.
    fn point(&self, pair: Pair, at: Configuration<D>) -> [f64; D] {
        at.at(self.main_nodes(pair.main)[0])
    }
}

/// Times of impact of feature pairs at constant velocities: continuous collision detection.
pub(crate) trait TimeOfImpact<const D: usize>: Topology<D> {
    /// Returns the time of impact within `duration` at constant velocities, s. A pair touches if
    /// its gap closes. It also touches if its main point, no deeper inside than `depth`, m, moves
    /// farther in while its foot point is on the target.
    fn time_of_impact(
        &self,
        pair: Pair,
        motion: ConstantMotion<D>,
        duration: f64,
        depth: f64,
    ) -> Option<f64>;
    /// Returns false if a cheap test shows that the features cannot touch in a drift from `at` to
    /// `end`: edges within flat faces cannot.
    fn may_touch_in_drift(
        &self,
        _pair: Pair,
        _at: Configuration<D>,
        _end: Configuration<D>,
    ) -> bool {
        true
    }
    /// Returns true if a pair touches now, no deeper than `depth`, m, and sinks in faster than
    /// `speed`, m/s. Parallel edges do not.
    fn sinks(&self, pair: Pair, motion: ConstantMotion<D>, depth: f64, speed: f64) -> bool;
    /// Returns true if a pair in contact, within `slack`, surely stays so for `duration` at
    /// constant velocities.
    fn stays_in_contact(
        &self,
        pair: Pair,
        motion: ConstantMotion<D>,
        duration: f64,
        slack: GapAllowance,
    ) -> bool;
}

/// Geometry of a contact point during its life: neighbours, Jacobian, material points, type.
pub(crate) trait ContactGeometry<const D: usize>: Distance<D> {
    /// Returns all feature pairs around the point of a pair, within `resolution`, m, which may touch
    /// there as well. For a point in the middle of a feature there are none but the pair itself.
    fn adjacent_pairs(&self, pair: Pair, at: Configuration<D>, resolution: f64) -> Pairs;
    /// Returns the pairs of the ends of the target edge that the point of a pair has crossed, each with
    /// the triangles of the main block at that point. The ends may lie far from the point. In the
    /// plane they are among the adjacent pairs.
    fn pairs_of_edge_ends(&self, _pair: Pair, _at: Configuration<D>) -> Pairs {
        Pairs::new()
    }
    /// Returns the pair of a point that has left its target, on the neighbouring target feature.
    fn neighbour(&self, pair: Pair, foot: &[f64; 2], at: Configuration<D>) -> Option<Pair>;
    /// Assembles the Jacobian of the pair at an anchor in place, because Jacobians are large and
    /// stay in the storage of the solver.
    fn assemble_jacobian(
        &self,
        jacobian: &mut ContactJacobian<D>,
        pair: Pair,
        anchor: JacobianAnchor<D>,
        at: Configuration<D>,
    );
    /// Returns a new Jacobian, with the normal that the surface gives.
    fn jacobian(&self, pair: Pair, foot: &[f64; 2], at: Configuration<D>) -> ContactJacobian<D> {
        let mut jacobian = ContactJacobian::default();
        let anchor = JacobianAnchor { foot, along: None };
        self.assemble_jacobian(&mut jacobian, pair, anchor, at);
        jacobian
    }
    /// Returns the material points of a pair with this `foot`, on the main and on the target.
    fn material_points(
        &self,
        pair: Pair,
        foot: &[f64; 2],
        rest: Configuration<D>,
    ) -> [MaterialPoint<D>; 2];
    /// Returns the pair at two material points, on the blocks with these node ranges, and its foot
    /// point.
    fn locate(
        &self,
        marks: &[MaterialPoint<D>; 2],
        nodes: [Range<u32>; 2],
        rest: Configuration<D>,
    ) -> Option<(Pair, [f64; 2])>;
    /// Returns the contact type of the two blocks at the pair, and its tributary area, m².
    fn classify(&self, pair: Pair, at: Configuration<D>, resolution: f64) -> (ContactKind, f64);
}

/// The boundaries of all blocks.
pub(crate) trait Surface<const D: usize>: TimeOfImpact<D> + ContactGeometry<D> {}

impl<const D: usize, T: TimeOfImpact<D> + ContactGeometry<D>> Surface<D> for T {}
