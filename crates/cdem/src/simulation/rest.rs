//! Stops a run that has come to rest (`time.stop_when`).

use crate::scene::StopWhen;
use crate::step::Run;

/// Watches the kinetic energy of every coarse step. Rest lasts; the highest point of a throw and
/// the turning point of a vibration pass.
#[derive(Debug)]
pub(crate) struct Rest {
    stop_when: StopWhen,
    /// First step of the current series of steps with the energy below the threshold.
    since: Option<u64>,
}

impl Rest {
    /// Creates the watch for a run at its start.
    pub(crate) fn new<const D: usize>(run: &Run<D>, stop_when: &StopWhen) -> Self {
        let mut rest = Self {
            stop_when: stop_when.clone(),
            since: None,
        };
        rest.update(run);
        rest
    }

    /// Returns the step since which the energy is below the threshold, for a checkpoint.
    pub(crate) fn since(&self) -> Option<u64> {
        self.since
    }

    /// Restores the step of a checkpoint.
    pub(crate) fn restore(&mut self, since: Option<u64>) {
        self.since = since;
    }

    /// Updates the watch after a coarse step.
    pub(crate) fn update<const D: usize>(&mut self, run: &Run<D>) {
        // The kinetic energy of one half step needs no synchronisation and is never negative,
        // unlike ½v⁻·M·v⁺ of the reports.
        let energy = run.kinetic_energy(&run.state.velocity);
        let low = energy < self.stop_when.kinetic_energy_below;
        self.since = low.then(|| self.since.unwrap_or(run.state.number));
    }

    /// True if the energy has been below the threshold for long enough.
    pub(crate) fn reached<const D: usize>(&self, run: &Run<D>) -> bool {
        self.since.is_some_and(|since| {
            let lasted = (run.state.number - since) as f64 * run.model.step;
            lasted >= self.stop_when.during
        })
    }
}
