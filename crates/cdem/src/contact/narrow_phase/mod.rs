//! Narrow phase: closest features, normal cones, tributary areas, Jacobians.

pub(crate) mod classification;
pub(crate) mod culling;
pub(crate) mod edge_edge;
pub(crate) mod feature_selection;
pub(crate) mod jacobian;
pub(crate) mod normal_cone;
pub(crate) mod point_triangle;
pub(crate) mod tributary_area;
