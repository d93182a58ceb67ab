//! The state of a run, from which another process continues bit for bit.
//!
//! A checkpoint stores the data that cannot be rebuilt from scene and mesh: motion, element records,
//! contacts and the search state, refinement zones, ledgers. Models, refined meshes, masses, levels and solvers
//! are rebuilt. Numbers are in the format of
//! [postcard](https://postcard.jamesmunns.com/wire-format).

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::scene::Scene;
use crate::simulation::energy_gain::EnergyGain;
use crate::simulation::observe::SynchronisedInstant;
use crate::simulation::validity::{ExchangedEnergy, ValidityGuard};
use crate::step::Run;
use crate::step::checkpoint::RunState;

/// The state of a simulation, as a checkpoint stores it.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SimulationState<'a, const D: usize> {
    pub(crate) run: RunState<'a, D>,
    pub(crate) report: Cow<'a, ReportState>,
}

/// The state that only reports and checks of a run need.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ReportState {
    /// Kinetic plus strain energy at t = 0, J.
    pub(crate) start_energy: f64,
    pub(crate) exchange: ExchangedEnergy,
    pub(crate) gain: EnergyGain,
    /// Time of the last request for block rows, s.
    pub(crate) last_block_rows: f64,
    pub(crate) validity: ValidityGuard,
    /// Step since which the condition of `stop_when` has been met.
    pub(crate) at_rest_since: Option<u64>,
}

impl ReportState {
    /// Returns the state of a run at t = 0, or after a change of its initial velocities.
    pub(crate) fn new<const D: usize>(
        run: &Run<D>,
        scene: &Scene,
        instant: &SynchronisedInstant<D>,
    ) -> Self {
        let start_energy = run.energy(instant);
        let stop_when = scene.time.stop_when.as_ref();
        Self {
            start_energy,
            exchange: ExchangedEnergy::new(run, scene, start_energy),
            gain: EnergyGain::default(),
            last_block_rows: 0.0,
            validity: ValidityGuard::new(run, scene),
            at_rest_since: stop_when.and_then(|stop_when| stop_when.at_rest_since(run, None)),
        }
    }
}
