//! Files for ParaView.

mod frame;
mod read;
mod series;
mod xml;

pub(super) use frame::write_contact_frame;
pub use frame::write_frame;
pub(crate) use read::{SavedFrame, read_frame};
pub(super) use series::{Series, listed};
