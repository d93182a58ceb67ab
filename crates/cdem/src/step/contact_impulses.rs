//! Impulses of contact in the state: sums of nodes and blocks, forces for local damping.

use crate::math::vector::{add_scaled, pad};
use crate::model::{Model, State};
use crate::step::schedule::Substep;

impl<const D: usize> State<D> {
    /// Stores the contact forces of a kick for local damping in the next kick.
    pub(super) fn store_contact_forces(&mut self, substep: &Substep, received: &[(u32, [f64; D])]) {
        let forces = [&mut *self.contact_force];
        substep.each_node(forces, &|_, [force]| *force = [0.0; D]);
        for (node, impulse) in received {
            let interval = self.last_kick.interval[*node as usize];
            if interval > 0.0 {
                let force = &mut self.contact_force[*node as usize];
                add_scaled(force, 1.0 / interval, impulse);
            }
        }
    }

    /// Adds contact impulses to the sums of nodes and blocks; those on fixed blocks go to the
    /// ledger. Adds their nodes to a list.
    pub(super) fn add_impulses(
        &mut self,
        model: &Model<D>,
        received: &[(u32, [f64; D])],
        touched_nodes: &mut Vec<u32>,
    ) {
        for (node, impulse) in received {
            let block = model.block_of[*node as usize] as usize;
            let padded = pad(impulse);
            add_scaled(&mut self.block_impulse[block], 1.0, &padded);
            if model.blocks[block].fixed {
                self.ledger.impulse.add_scaled(-1.0, &padded);
            }
            add_scaled(&mut self.node_impulse[*node as usize], 1.0, impulse);
            touched_nodes.push(*node);
        }
    }
}
