//! Continuous collision detection: the time of impact of a feature pair.

pub(crate) mod signed_volume;
pub(crate) mod time_of_impact;
pub(crate) mod touch_events;
