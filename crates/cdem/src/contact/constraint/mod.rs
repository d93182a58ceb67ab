//! Contact points while they last, their law and constraints.

pub(crate) mod active_set;
pub(crate) mod contact_point;
pub(crate) mod law;
