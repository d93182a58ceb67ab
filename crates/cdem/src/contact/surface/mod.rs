//! Boundaries of the blocks, as contact uses them, in any dimension.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

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
mod sharp_edges;
#[cfg(test)]
mod trait_tests;
pub(crate) mod traits;
pub(crate) mod triangulation;

pub(crate) use crate::contact::surface::configuration::Configuration;
pub(crate) use crate::contact::surface::jacobian::ContactJacobian;
pub(crate) use crate::contact::surface::kicked::ConstantMotion;
pub(crate) use crate::contact::surface::material_point::{FeatureKind, MaterialPoint};
pub(crate) use crate::contact::surface::traits::{
    ContactGeometry, Distance, Surface, TimeOfImpact, Topology,
};

/// Returns the largest distance beyond an edge, m, at which a point may touch the face on the other
/// side of the edge, with `depth` of penetration in that face. `turn` is the turn of the edge, rad.
/// Returns 0 for a convex edge.
///
/// The distance in the plane of the face is the depth over the sine of the turn. If the faces are
/// flush, they are one contact with equal depths, and the distance is the depth times half the turn
/// or more.
pub(crate) fn beyond_reentrant(turn: f64, depth: f64) -> f64 {
    if turn < -FLUSH {
        depth / (-turn).sin().max(FLUSH)
    } else {
        depth * (-turn).max(0.0)
    }
}

/// A main feature against a target feature: in 2-D a vertex and an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct Pair {
    /// Number of the main feature.
    pub(crate) main: u32,
    /// Number of the target feature.
    pub(crate) target: u32,
}

/// Pairs around one point; the usual number needs no heap memory.
pub(super) type Pairs = SmallVec<[Pair; 16]>;

/// Position of the main point relative to the target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// Signed distance along the normal, m; negative inside the target.
    pub(crate) gap: f64,
    /// Parameters of the foot point on the target.
    pub(crate) foot: [f64; 2],
    /// Distance of the foot point outside the target feature, m; ≤ 0 within it.
    pub(crate) outside: f64,
}

impl Projection {
    /// Returns the parameters of the foot point, each clamped to 0 to 1.
    pub(crate) fn clamped_foot(&self) -> [f64; 2] {
        self.foot.map(|w| w.clamp(0.0, 1.0))
    }
}

/// Place and side at which a Jacobian is assembled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JacobianAnchor<'a, const D: usize> {
    /// Parameters of the point of the target.
    pub(crate) foot: &'a [f64; 2],
    /// Direction on the side of the normal; `None` for the side that the surface gives.
    pub(crate) along: Option<&'a [f64; D]>,
}

/// Gaps and penetrations that count as closed contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GapAllowance {
    /// Largest gap of a pair in contact at the start of a drift, and largest penetration of a pair
    /// that was left to sink in, m.
    pub(crate) within: f64,
    /// Penetration allowed at the end of the drift, m.
    pub(crate) depth: f64,
}
