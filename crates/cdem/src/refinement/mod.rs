//! The second scale: elements bisected around places of contact (design, section
//! 6; [Li2015], section 5).
//!
//! A [`Forest`] holds what has become of the elements of a block that are refined,
//! each the root of a tree of halves. It is made anew from the base mesh and from
//! what is wanted of it, so it depends on these alone and not on earlier forests;
//! without wishes it is empty, and the mesh is the base mesh again.

mod base;
mod cell;
pub(crate) mod checkpoint;
mod cover;
#[cfg(test)]
mod cover_tests;
mod depth;
mod foresee;
mod forest;
mod foundation;
mod impacts;
mod inside;
mod mass;
mod momenta;
mod nesting;
mod overlay;
#[cfg(test)]
mod overlay_tests;
mod refined;
mod second_scale;
mod star;
#[cfg(test)]
mod tests;
mod transfer;
mod twist;
mod zone;

pub(crate) use base::Base;
#[cfg(test)]
use cell::{Cell, Tetrahedron, Triangle};
pub(crate) use cover::Cover;
pub(crate) use depth::Encounter;
pub(crate) use foresee::FORESEEN_SPEED;
#[cfg(test)]
use forest::Forest;
pub(crate) use foundation::Foundation;
pub(crate) use momenta::{Body, Momenta};
pub(crate) use overlay::{MakeOverlay, Overlay, plane_overlay, solid_overlay};
pub(crate) use second_scale::{Change, SecondScale};
pub(crate) use transfer::{Transfer, predecessors};
pub(crate) use twist::Twists;
