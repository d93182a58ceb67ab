//! What is done to a run from outside, between two steps.

use crate::math::vector::{add_scaled, pad, sub};
use crate::scene::LoadKind;
use crate::step::{Run, Synchronised};

impl<const D: usize> Run<D> {
    /// Gives nodes the velocities `wanted` at the instant `now`, m/s, but where they are held.
    ///
    /// Velocities half a step before and after change by the same, so that central differences
    /// go on as they are. Momentum comes from outside.
    pub(crate) fn shift_velocities(&mut self, now: &Synchronised<D>, wanted: &[[f64; D]]) {
        let change = |(node, wanted): (usize, &[f64; D])| {
            let held = self.model.inertia.prescribed(node);
            let is_fixed = self.model.is_fixed(node as u32);
            let change = sub(wanted, &now.velocity[node]);
            std::array::from_fn(|c| if is_fixed || held[c] { 0.0 } else { change[c] })
        };
        let changes: Vec<[f64; D]> = wanted.iter().enumerate().map(change).collect();
        for (node, change) in changes.iter().enumerate() {
            add_scaled(&mut self.state.velocity[node], 1.0, change);
            let momentum = self.model.inertia.momentum(node, &changes);
            self.ledger.impulse.add_scaled(1.0, &pad(&momentum));
        }
    }

    /// Books what has been done from outside, J.
    pub(crate) fn book_from_outside(&mut self, work: f64) {
        self.ledger.external_work += work;
    }

    /// Has a load push otherwise from now on.
    pub(crate) fn set_load(&mut self, number: usize, kind: &LoadKind) {
        self.model.loads[number].become_kind(kind.clone());
        if let Some(second) = &mut self.adaptivity {
            // The model is made anew from this one where the mesh changes.
            second.base_model.scene.load[number].kind = kind.clone();
        }
    }
}
