//! Refinement and coarsening of blocks between two steps (design, section 6).

pub(crate) mod conserve;
pub(crate) mod relax_energy;
pub(crate) mod remesh;
pub(crate) mod transfer;
pub(crate) mod when;
