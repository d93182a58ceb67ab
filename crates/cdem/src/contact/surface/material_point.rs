//! Material points on features, by which a contact point finds its features in another mesh.

use crate::contact::tolerances::LIKE_NORMALS;
use crate::math::vector::{dot, norm};

/// A material point on a feature, independent of the nodes of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MaterialPoint<const D: usize> {
    /// Position at rest, m.
    pub(crate) position: [f64; D],
    /// Kind of its feature.
    pub(crate) kind: FeatureKind<D>,
    /// Outward direction at rest. It tells the two lips of a crack apart, which share positions.
    pub(crate) outward: [f64; D],
}

impl<const D: usize> MaterialPoint<D> {
    /// Returns true if `outward` is not like the outward direction of this point, as on the other
    /// lip of a crack.
    pub(crate) fn is_on_other_side(&self, outward: &[f64; D]) -> bool {
        let sizes = norm(&self.outward) * norm(outward);
        dot(&self.outward, outward) < LIKE_NORMALS * sizes
    }
}

/// A kind of feature, at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FeatureKind<const D: usize> {
    Vertex,
    /// An edge of this unit direction, or the opposite one.
    Edge([f64; D]),
    /// A face; in 2-D an edge.
    Face,
}
