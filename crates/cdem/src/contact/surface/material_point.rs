//! Material points on features: how a contact point finds its features in another mesh.

use crate::contact::tolerances::LIKE_NORMALS;
use crate::math::vector::{dot, norm};

/// A material point on a feature, wherever the mesh has its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MaterialPoint<const D: usize> {
    /// Place at rest, m.
    pub(crate) place: [f64; D],
    /// What kind of feature it is on.
    pub(crate) kind: FeatureKind<D>,
    /// Where that looks to at rest: the two lips of a crack are at one place.
    pub(crate) outward: [f64; D],
}

impl<const D: usize> MaterialPoint<D> {
    /// Whether what looks to another side than its feature, as the other lip of a crack does.
    pub(crate) fn is_unlike(&self, outward: &[f64; D]) -> bool {
        let sizes = norm(&self.outward) * norm(outward);
        dot(&self.outward, outward) < LIKE_NORMALS * sizes
    }
}

/// A kind of feature, at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FeatureKind<const D: usize> {
    Vertex,
    /// Of this unit direction, or the opposite one.
    Edge([f64; D]),
    /// In the plane an edge.
    Face,
}
