//! The energy ledger (design, section 7).

use serde::{Deserialize, Serialize};

use crate::math::vector::{Sum, dot, pad};

/// Sums since t = 0: work and losses, J, and the impulse of all external forces, N·s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ledger {
    pub(crate) external_work: f64,
    pub(crate) gravity_work: f64,
    pub(crate) damping_loss: f64,
    pub(crate) correction_loss: f64,
    /// Change of the measured energy by changes of time levels, and energy lost with refined
    /// elements that are removed.
    pub(crate) remesh_loss: f64,
    pub(crate) impulse: Sum<3>,
}

/// The account that an impulse belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImpulseAccount {
    /// Loads and reactions of prescribed motion.
    External,
    /// Gravity.
    Gravity,
    /// Damping by external forces: mass-proportional and local.
    Damping,
    /// Damping inside the body. It has no resultant.
    Viscosity,
}

impl Ledger {
    /// Books an impulse on a node. All impulses of the substep take its velocity from `before` to
    /// `after`, so the work is J·(before + after)/2.
    pub(crate) fn book<const D: usize>(
        &mut self,
        account: ImpulseAccount,
        impulse: &[f64; D],
        [before, after]: [&[f64; D]; 2],
    ) {
        let work = 0.5 * (dot(impulse, before) + dot(impulse, after));
        match account {
            ImpulseAccount::External => self.external_work += work,
            ImpulseAccount::Gravity => self.gravity_work += work,
            ImpulseAccount::Damping | ImpulseAccount::Viscosity => self.damping_loss -= work,
        }
        if account != ImpulseAccount::Viscosity {
            self.impulse.add_scaled(1.0, &pad(impulse));
        }
    }

    /// Adds another ledger times `factor`.
    pub(crate) fn add(&mut self, factor: f64, other: &Self) {
        self.external_work += factor * other.external_work;
        self.gravity_work += factor * other.gravity_work;
        self.damping_loss += factor * other.damping_loss;
        self.correction_loss += factor * other.correction_loss;
        self.remesh_loss += factor * other.remesh_loss;
        self.impulse.add_sum(factor, &other.impulse);
    }
}

/// Velocity at which the impulses of a kick do their work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum WorkVelocity {
    /// Mean of the velocities before and after the kick: for the whole kick.
    #[default]
    Mean,
    /// Velocity before the kick: for the part of the kick that belongs to the interval before.
    Before,
}
