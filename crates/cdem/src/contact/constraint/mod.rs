//! Contact points while they last, their law and constraints.

pub(crate) mod active_set;
pub(crate) mod contact_constraint;
pub(crate) mod contact_point;
pub(crate) mod context;
pub(crate) mod initial_overlap;
pub(crate) mod law;
