//! Where the nodes are and how they move.

use crate::contact::surface::Positions;

/// Displacements and velocities of all nodes: what a step changes.
pub(crate) struct Motion<'a, const D: usize> {
    /// Rest positions, m.
    pub(crate) rest: &'a [[f64; D]],
    /// Displacements, m.
    pub(crate) displacement: &'a mut [[f64; D]],
    /// What round-off has kept from the displacements, m.
    pub(crate) carry: &'a mut [[f64; D]],
    /// Velocities, m/s.
    pub(crate) velocity: &'a mut [[f64; D]],
}

impl<const D: usize> Motion<'_, D> {
    /// Current positions.
    pub(crate) fn positions(&self) -> Positions<'_, D> {
        Positions::new(self.rest, self.displacement)
    }

    /// Moves `nodes` for `duration` at constant velocities, in compensated
    /// sums: plain ones drift 1e-11 over a million substeps.
    pub(crate) fn drift(&mut self, nodes: &[u32], duration: f64) {
        for &node in nodes {
            let node = node as usize;
            for c in 0..D {
                let old = self.displacement[node][c];
                let change = duration * self.velocity[node][c] - self.carry[node][c];
                let new = old + change;
                self.carry[node][c] = (new - old) - change;
                self.displacement[node][c] = new;
            }
        }
    }
}
