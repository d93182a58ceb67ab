//! Files for ParaView.

mod frame;
mod series;
mod xml;

pub(super) use frame::write_contact_frame;
pub use frame::write_frame;
pub(super) use series::Series;
