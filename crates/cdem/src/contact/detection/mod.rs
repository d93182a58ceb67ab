//! Detection: candidate pairs, from boxes and bounds on motion.

pub(crate) mod active_candidates;
mod broad_phase;
pub(crate) mod candidates;
pub(crate) mod clusters;
pub(crate) mod grid;
pub(crate) mod motion_bounds;
pub(crate) mod separation_bounds;
#[cfg(test)]
mod separation_bounds_tests;
