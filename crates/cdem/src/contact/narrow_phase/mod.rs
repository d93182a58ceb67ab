//! Narrow phase: closest features, normal cones, tributary areas, Jacobians.

pub(crate) mod boundary_2d;
pub(crate) mod boundary_3d;
pub(crate) mod classification;
pub(crate) mod culling;
pub(crate) mod edge_edge;
pub(crate) mod feature_selection;
pub(crate) mod jacobian;
pub(crate) mod material_point_3d;
pub(crate) mod normal_cone;
pub(crate) mod point_triangle;
pub(crate) mod target_walk;
pub(crate) mod tributary_area;
