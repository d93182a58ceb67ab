//! Continuous collision detection: the time of impact of a feature pair.

pub(crate) mod boundary_2d;
pub(crate) mod boundary_3d;
pub(crate) mod instant;
pub(crate) mod signed_volume;
