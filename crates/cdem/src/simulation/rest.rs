//! Stops a run that has come to rest (`time.stop_when`).

use crate::scene::StopWhen;
use crate::step::Run;

impl StopWhen {
    /// Returns the first step of the current series of steps with a kinetic energy below the
    /// threshold. `since` is that before the last step. Rest lasts; the highest point of a throw
    /// and the turning point of a vibration pass.
    pub(crate) fn at_rest_since<const D: usize>(
        &self,
        run: &Run<D>,
        since: Option<u64>,
    ) -> Option<u64> {
        // The kinetic energy of one half step needs no synchronisation and is never negative,
        // unlike ½v⁻·M·v⁺ of the reports.
        let energy = run.kinetic_energy(&run.state.velocity);
        let is_low = energy < self.kinetic_energy_below;
        is_low.then(|| since.unwrap_or(run.state.number))
    }

    /// True if the energy has been below the threshold for long enough.
    pub(crate) fn is_met<const D: usize>(&self, run: &Run<D>, since: Option<u64>) -> bool {
        since.is_some_and(|since| {
            let lasted = (run.state.number - since) as f64 * run.model.step;
            lasted >= self.during
        })
    }
}
