//! What contact needs to know of the blocks' surfaces, in any dimension.

use crate::contact::tolerances::FLUSH;

pub(crate) mod aabb;
pub(crate) mod boundary_2d;
pub(crate) mod boundary_3d;
pub(crate) mod configuration;
pub(crate) mod contact_kind;
pub(crate) mod geometry_cache;
pub(crate) mod jacobian;
pub(crate) mod kicked;
pub(crate) mod material_point;
#[cfg(test)]
mod material_point_tests;
pub(crate) mod traits;
pub(crate) mod triangulation;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

pub(crate) use crate::contact::surface::configuration::Configuration;
pub(crate) use crate::contact::surface::jacobian::ContactJacobian;
pub(crate) use crate::contact::surface::material_point::{FeatureKind, MaterialPoint};
pub(crate) use crate::contact::surface::traits::{
    ContactGeometry, Distance, Surface, TimeOfImpact, Topology,
};

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
pub(crate) enum CullingResult {
    /// They may.
    Near,
    /// They are too far from each other, at least by a little.
    Apart,
    /// They may not for how they lie, as long as the reach and [`CULLING_RATE`](crate::contact::tolerances::CULLING_RATE) times the ways
    /// of both blocks' nodes since are less than this together, m.
    Lacks(f64),
}

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

/// What of a gap is none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GapAllowance {
    /// Of a pair that touches at the start of a drift, or that was left to sink in, m.
    pub(crate) within: f64,
    /// How deep it may be at the end, m.
    pub(crate) depth: f64,
    /// Gap above which a pair waits for the next kick, m; infinite where none can.
    pub(crate) clear: f64,
}
