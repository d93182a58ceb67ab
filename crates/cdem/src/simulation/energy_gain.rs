//! Energy that losses give back. The sum of all losses only grows; where it falls, blocks get energy
//! without a source, and the ledger still balances. A gain while other losses grow by more is not seen.

use serde::{Deserialize, Serialize};

use crate::math::format::significant;
use crate::refinement::Adaptivity;
use crate::simulation::validity::ExchangedEnergy;
use crate::step::Run;

/// Energy gain, as a fraction of the energy exchanged, above which the user is warned. Half-steps
/// and changes of time levels shift less between losses and measured energies.
const GAIN_WARNING: f64 = 0.01;

/// The largest fall of the sum of all losses so far.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct EnergyGain {
    /// Largest sum of the losses so far, J.
    most_lost: f64,
    /// Largest fall from it, J, and its time, s.
    gain: f64,
    time: f64,
}

impl EnergyGain {
    /// Updates the gain after a step of `run`.
    pub(crate) fn track<const D: usize>(&mut self, run: &Run<D>) {
        let ledger = &run.state.ledger;
        let of_bodies = ledger.damping_loss + ledger.remesh_loss + ledger.correction_loss;
        let of_contacts = run.contacts.as_ref().map_or(0.0, |contacts| {
            let energies = contacts.energies();
            energies.impact_loss + energies.friction_loss + energies.fracture_loss
        });
        // Energy debts are taken back later.
        let adaptivity = run.adaptivity.as_ref();
        let in_debt = adaptivity.map_or(0.0, Adaptivity::energy_in_debt);
        self.add(of_bodies + of_contacts + in_debt, run.time());
    }

    /// Updates the gain at a `time`, s, at which so much has been `lost`, J.
    fn add(&mut self, lost: f64, time: f64) {
        self.most_lost = self.most_lost.max(lost);
        let gain = self.most_lost - lost;
        if gain > self.gain {
            (self.gain, self.time) = (gain, time);
        }
    }

    /// Returns a warning if the gain is large.
    pub(crate) fn warning(&self, exchange: &ExchangedEnergy, is_refined: bool) -> Option<String> {
        let other_model = if is_refined {
            " or `contact.model = \"unified-node\"`"
        } else {
            ""
        };
        let share = self.gain / exchange.scale();
        (share > GAIN_WARNING).then(|| {
            format!(
                "the sum of all losses fell by {} J until t = {} s, {} % of the energy exchanged: \
                 contacts, corrections of positions or changes of mesh gave energy to the blocks; \
                 compare with a smaller `time.safety`{}",
                significant(self.gain, 3),
                significant(self.time, 4),
                significant(100.0 * share, 2),
                other_model
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::EnergyGain;

    #[test]
    fn the_gain_is_the_largest_fall_of_the_losses() {
        let mut gain = EnergyGain::default();
        for (time, lost) in [0.0, 2.0, 1.5, 3.0, 0.5, 2.9, 4.0].into_iter().enumerate() {
            gain.add(lost, time as f64);
        }
        assert_eq!((gain.gain, gain.time), (2.5, 4.0));
    }
}
