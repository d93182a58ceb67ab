//! Contact points, their law and their constraints.

pub(crate) mod active_set;
pub(crate) mod contact_constraint;
pub(crate) mod contact_history;
pub(crate) mod contact_point;
pub(crate) mod context;
pub(crate) mod duplicate;
mod impact_constraint;
pub(crate) mod initial_overlap;
pub(crate) mod law;
pub(crate) mod quadratic_change;
pub(crate) mod target_tracking;
