//! Changes to a run from outside, between two steps.

use crate::math::vector::{add_scaled, pad, sub};
use crate::scene::LoadKind;
use crate::step::{Run, Synchronised};

impl<const D: usize> Run<D> {
    /// Sets the velocities of nodes to `wanted` at the instant `now`, m/s, except for prescribed
    /// components.
    ///
    /// Velocities half a step before and after change by the same amount, so central differences
    /// continue unchanged. The change of momentum is booked as external.
    pub(crate) fn set_velocities_at(&mut self, now: &Synchronised<D>, wanted: &[[f64; D]]) {
        let change = |(node, wanted): (usize, &[f64; D])| {
            let prescribed = self.model.inertia.prescribed(node);
            let is_fixed = self.model.is_fixed(node as u32);
            let change = sub(wanted, &now.velocity[node]);
            std::array::from_fn(|c| {
                if is_fixed || prescribed[c] {
                    0.0
                } else {
                    change[c]
                }
            })
        };
        let changes: Vec<[f64; D]> = wanted.iter().enumerate().map(change).collect();
        for (node, change) in changes.iter().enumerate() {
            add_scaled(&mut self.state.velocity[node], 1.0, change);
            let momentum = self.model.inertia.momentum(node, &changes);
            self.state.ledger.impulse.add_scaled(1.0, &pad(&momentum));
        }
    }

    /// Books external work, J.
    pub(crate) fn add_external_work(&mut self, work: f64) {
        self.state.ledger.external_work += work;
    }

    /// Changes the kind of a load from now on.
    pub(crate) fn set_load(&mut self, number: usize, kind: &LoadKind) {
        self.model.loads[number].set_kind(kind.clone());
        if let Some(adaptivity) = &mut self.adaptivity {
            // A remesh rebuilds the loads from this scene.
            adaptivity.base_model.scene.load[number].kind = kind.clone();
        }
    }
}
