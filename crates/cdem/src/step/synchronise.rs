//! The synchronised state: the state at an instant, in the middle of the kick that is due then.

use crate::contact::energy::ContactEnergies;
use crate::math::vector::{add, add_scaled, dot, pad, scale};
use crate::model::kinematics::NodalMotion;
use crate::model::ledger::Ledger;
use crate::step::Run;

/// The state at an instant, with half of the due kick in it.
pub(crate) struct Synchronised<const D: usize> {
    /// Velocities, contact included, m/s.
    pub(crate) velocity: Vec<[f64; D]>,
    /// ½v⁻·M·v⁺ of the velocities before and after that kick, J. With U it is the energy that
    /// central differences conserve. The kinetic energy of `velocity` is higher by the energy of
    /// half of the kick, and ripples by (ωΔt)² for waves near the resolution limit of the mesh.
    pub(crate) kinetic_energy: f64,
    /// The ledger at that instant.
    pub(crate) ledger: Ledger,
    /// Losses of contact in the first half of the kick, J.
    pub(crate) impact_loss: f64,
    pub(crate) friction_loss: f64,
}

impl<const D: usize> Run<D> {
    /// Returns the synchronised state now.
    pub(crate) fn synchronise(&mut self) -> Synchronised<D> {
        let plan = std::mem::take(&mut self.schedule);
        let time = self.time();
        let substep = plan.report(self.model.step, time);
        let mut velocity = self.state.velocity.clone();
        self.model
            .kick(&mut self.state, &mut velocity, &mut self.impulses, &substep);
        let mut half = Ledger::default();
        let (ledgers, received) = self.peek_contacts(&mut velocity);
        for (node, impulse) in &received {
            add_scaled(&mut self.impulses.contact[*node as usize], 1.0, impulse);
            if self.model.is_fixed(*node) {
                half.impulse.add_scaled(-1.0, &pad(impulse));
            }
        }
        self.model
            .book_damping(&velocity, &mut self.impulses, &substep);
        self.model
            .book_kick(&velocity, &mut self.impulses, &substep, &mut half);
        let kinetic_energy = self.kinetic_energy(&velocity);
        substep.each_node([&mut *velocity], &|n, [after]| {
            *after = scale(0.5, &add(&self.state.velocity[n], after));
        });
        self.impulses.clear();
        for (node, _) in &received {
            self.impulses.contact[*node as usize] = [0.0; D];
        }
        let mut ledger = self.ledger;
        ledger.add(0.5, &half);
        self.schedule = plan;
        Synchronised {
            velocity,
            kinetic_energy,
            ledger,
            impact_loss: 0.5 * ledgers.impact_loss,
            friction_loss: 0.5 * ledgers.friction_loss,
        }
    }

    /// Previews the contact impulses of a kick. Changes `velocity` only; returns the energies that
    /// contact would take and its impulses on nodes, N·s.
    fn peek_contacts(
        &mut self,
        velocity: &mut [[f64; D]],
    ) -> (ContactEnergies, Vec<(u32, [f64; D])>) {
        let mut received = Vec::new();
        let Some(contacts) = self.contacts.as_ref().filter(|_| self.state.number > 0) else {
            return (ContactEnergies::default(), received);
        };
        let interval = &self.impulses.interval;
        let mut motion = NodalMotion {
            rest: &self.model.mesh.nodes,
            displacement: &mut self.state.displacement,
            compensation: &mut self.state.compensation,
            velocity,
        };
        let ledgers = contacts.preview_kick(
            &mut motion,
            &self.model.inertia,
            &self.impulses.before,
            &|node| Some((interval[node as usize], interval[node as usize])),
            &mut |node, impulse: &[f64; D]| received.push((node, *impulse)),
        );
        (ledgers, received)
    }

    /// Returns ½v⁻·M·v⁺ of all blocks that are not fixed, J.
    pub(crate) fn kinetic_energy(&self, after: &[[f64; D]]) -> f64 {
        let nodes = 0..self.model.mesh.nodes.len();
        let nodes = nodes.filter(|&node| !self.model.is_fixed(node as u32));
        let energy = |node: usize| {
            0.5 * dot(
                &self.state.velocity[node],
                &self.model.inertia.momentum(node, after),
            )
        };
        nodes.map(energy).sum()
    }
}
