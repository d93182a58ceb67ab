//! Whether a run has come to rest (`time.stop_when`).

use crate::scene::StopWhen;
use crate::step::Run;

/// Looks at the kinetic energy of every coarse step: a rest lasts, while the
/// highest point of a throw and the turn of a vibration pass.
#[derive(Debug)]
pub(crate) struct Rest {
    stop_when: StopWhen,
    /// The first of the steps up to now at which the energy was below.
    since: Option<u64>,
}

impl Rest {
    /// Of a run at its start.
    pub(crate) fn new<const D: usize>(run: &Run<D>, stop_when: &StopWhen) -> Self {
        let mut rest = Self {
            stop_when: stop_when.clone(),
            since: None,
        };
        rest.look(run);
        rest
    }

    /// What a checkpoint holds of it.
    pub(crate) fn since(&self) -> Option<u64> {
        self.since
    }

    /// Goes on with that.
    pub(crate) fn restore(&mut self, since: Option<u64>) {
        self.since = since;
    }

    /// Looks at the run after a coarse step.
    pub(crate) fn look<const D: usize>(&mut self, run: &Run<D>) {
        // That of one half step, which takes no synchronisation and is never
        // negative, unlike ½v⁻·M·v⁺ of the reports.
        let energy = run.kinetic_energy(&run.state.velocity);
        let low = energy < self.stop_when.kinetic_energy_below;
        self.since = low.then(|| self.since.unwrap_or(run.state.number));
    }

    /// Whether the energy has been below for long enough.
    pub(crate) fn reached<const D: usize>(&self, run: &Run<D>) -> bool {
        self.since.is_some_and(|since| {
            let lasted = (run.state.number - since) as f64 * run.model.step;
            lasted >= self.stop_when.during
        })
    }
}
