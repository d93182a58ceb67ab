//! The synchronised state: the state at an instant, in the middle of the kick that is due then.

use crate::contact::energy::ContactEnergies;
use crate::contact::island::parallel::IslandKicks;
use crate::contact::timing::{KickTimes, NodeDrifts};
use crate::math::vector::{add, add_scaled, dot, pad, scale};
use crate::model::kinematics::NodalMotion;
use crate::model::ledger::Ledger;
use crate::step::Run;
use crate::step::kick::KickVelocities;

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
        let schedule = std::mem::take(&mut self.workspace.schedule);
        let time = self.time();
        let substep = schedule.report(self.model.step, time);
        let mut velocity = self.state.velocity.clone();
        self.model.kick(
            &mut self.state,
            &mut velocity,
            &mut self.workspace.impulses,
            &substep,
        );
        let mut half = Ledger::default();
        let (ledgers, received) = self.preview_contacts(&mut velocity);
        for (node, impulse) in &received {
            add_scaled(
                &mut self.workspace.impulses.contact[*node as usize],
                1.0,
                impulse,
            );
            if self.model.is_fixed(*node) {
                half.impulse.add_scaled(-1.0, &pad(impulse));
            }
        }
        let impulses = &mut self.workspace.impulses;
        let last_kick = &self.state.last_kick;
        self.model
            .book_damping(last_kick, &velocity, impulses, &substep);
        let velocities = KickVelocities {
            last_kick,
            after: &velocity,
        };
        self.model
            .book_kick(velocities, impulses, &substep, &mut half);
        let kinetic_energy = self.kinetic_energy(&velocity);
        substep.each_node([&mut *velocity], &|n, [after]| {
            *after = scale(0.5, &add(&self.state.velocity[n], after));
        });
        self.workspace.impulses.clear();
        for (node, _) in &received {
            self.workspace.impulses.contact[*node as usize] = [0.0; D];
        }
        let mut ledger = self.state.ledger;
        ledger.add(0.5, &half);
        self.workspace.schedule = schedule;
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
    fn preview_contacts(
        &mut self,
        velocity: &mut [[f64; D]],
    ) -> (ContactEnergies, Vec<(u32, [f64; D])>) {
        let mut received = Vec::new();
        let Some(contacts) = self.contacts.as_ref().filter(|_| self.state.number > 0) else {
            return (ContactEnergies::default(), received);
        };
        let mut motion = NodalMotion {
            rest: &self.model.mesh.nodes,
            displacement: &mut self.state.displacement,
            compensation: &mut self.state.compensation,
            velocity,
        };
        let interval = &self.state.last_kick.interval;
        let kick = IslandKicks {
            before: &self.state.last_kick.velocity_before,
            times: KickTimes {
                time: 0.0,
                interval,
                drift: NodeDrifts::OfNodes(interval),
            },
        };
        let ledgers = contacts.preview_kick(&mut motion, &self.model.inertia, &kick, &mut received);
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
