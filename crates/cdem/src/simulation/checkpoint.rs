//! The state of a run, from which another process continues bit for bit.
//!
//! A checkpoint stores the data that cannot be rebuilt from scene and mesh: motion, contacts and
//! the search state, refinement zones, ledgers. Models, refined meshes, masses, levels and solvers
//! are rebuilt. Numbers are in the format of
//! [postcard](https://postcard.jamesmunns.com/wire-format).

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::simulation::validity::{ExchangedEnergy, ValidityGuard};
use crate::step::checkpoint::SavedRun;

/// A run in a checkpoint, with the data that only its reports need.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SavedSimulation<'a, const D: usize> {
    pub(crate) run: SavedRun<'a, D>,
    /// Kinetic plus strain energy at t = 0, J.
    pub(crate) start_energy: f64,
    pub(crate) exchange: ExchangedEnergy,
    /// Time of the last request for block rows, s.
    pub(crate) last_block_rows: f64,
    pub(crate) health: Cow<'a, ValidityGuard>,
    /// Step since which the condition of `stop_when` has been met.
    pub(crate) at_rest_since: Option<u64>,
}
