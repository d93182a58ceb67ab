//! All that a run has come to, for another process to go on from, bit for bit.
//!
//! It holds what cannot be made anew from scene and mesh: motion, contacts with the search
//! that found them, zones, ledgers. Models, refined meshes, masses, levels and solvers are made
//! anew. Numbers are in the format of [postcard](https://postcard.jamesmunns.com/wire-format).

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::simulation::validity::{ExchangedEnergy, ValidityGuard};
use crate::step::checkpoint::SavedRun;

/// A run in a checkpoint, with what only its reports need.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SavedSimulation<'a, const D: usize> {
    pub(crate) run: SavedRun<'a, D>,
    /// Kinetic plus strain energy at t = 0, J.
    pub(crate) start_energy: f64,
    pub(crate) exchange: ExchangedEnergy,
    /// When rows of blocks were last asked for, s.
    pub(crate) last_block_rows: f64,
    pub(crate) health: Cow<'a, ValidityGuard>,
    /// The step since which `stop_when` is fulfilled.
    pub(crate) at_rest_since: Option<u64>,
}
