//! The energy balance of a run: all energies, works and losses at an instant.

use crate::step::{Run, Synchronised};

/// Energies, works and losses at an instant, J.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EnergyBalance {
    pub(crate) kinetic_energy: f64,
    pub(crate) strain_energy: f64,
    pub(crate) external_work: f64,
    pub(crate) gravity_work: f64,
    pub(crate) impact_loss: f64,
    pub(crate) friction_loss: f64,
    pub(crate) damping_loss: f64,
    pub(crate) fracture_loss: f64,
    pub(crate) remesh_loss: f64,
    pub(crate) correction_loss: f64,
}

impl EnergyBalance {
    /// Returns the energy that the balance cannot explain, J; `start_energy` is the kinetic plus
    /// strain energy at t = 0, J.
    pub(crate) fn residual(&self, start_energy: f64) -> f64 {
        self.kinetic_energy
            + self.strain_energy
            + self.impact_loss
            + self.friction_loss
            + self.damping_loss
            + self.fracture_loss
            + self.remesh_loss
            + self.correction_loss
            - self.external_work
            - self.gravity_work
            - start_energy
    }
}

impl<const D: usize> Run<D> {
    /// Returns the energy balance at the instant of a synchronised `state`.
    pub(crate) fn energy_balance(&self, state: &Synchronised<D>) -> EnergyBalance {
        let mut balance = EnergyBalance {
            kinetic_energy: state.kinetic_energy,
            strain_energy: self.model.strain_energy(&self.state.displacement),
            external_work: state.ledger.external_work,
            gravity_work: state.ledger.gravity_work,
            damping_loss: state.ledger.damping_loss,
            correction_loss: state.ledger.correction_loss,
            remesh_loss: state.ledger.remesh_loss,
            ..EnergyBalance::default()
        };
        if let Some(contacts) = &self.contacts {
            let at = self.model.positions(&self.state);
            balance.strain_energy += contacts.spring_energy(at.into());
            balance.impact_loss = contacts.energies().impact_loss + state.impact_loss;
            balance.friction_loss = contacts.energies().friction_loss + state.friction_loss;
            balance.fracture_loss = contacts.energies().fracture_loss;
        }
        balance
    }
}
