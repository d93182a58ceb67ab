//! Positions and velocities of the nodes.

use crate::model::positions::Positions;

/// Speed of light in vacuum, m/s: no node is faster.
pub(crate) const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Displacements and velocities of all nodes, which a step changes.
pub(crate) struct NodalMotion<'a, const D: usize> {
    /// Rest positions, m.
    pub(crate) rest: &'a [[f64; D]],
    /// Displacements, m.
    pub(crate) displacement: &'a mut [[f64; D]],
    /// Rounding errors of the displacements, m, for compensated sums.
    pub(crate) compensation: &'a mut [[f64; D]],
    /// Velocities, m/s.
    pub(crate) velocity: &'a mut [[f64; D]],
}

/// Displacement of a node and its rounding error, m, and velocity of the node, m/s.
pub(crate) type NodeState<const D: usize> = [[f64; D]; 3];

/// A copy of the arrays that [`NodalMotion`] changes.
pub(crate) struct MotionCopy<const D: usize> {
    displacement: Vec<[f64; D]>,
    compensation: Vec<[f64; D]>,
    velocity: Vec<[f64; D]>,
}

impl<const D: usize> MotionCopy<D> {
    /// Borrows the copy as the motion of nodes with these rest positions, m.
    pub(crate) fn motion<'a>(&'a mut self, rest: &'a [[f64; D]]) -> NodalMotion<'a, D> {
        NodalMotion {
            rest,
            displacement: &mut self.displacement,
            compensation: &mut self.compensation,
            velocity: &mut self.velocity,
        }
    }
}

impl<const D: usize> NodalMotion<'_, D> {
    /// Returns a copy of displacements, rounding errors and velocities.
    pub(crate) fn copied(&self) -> MotionCopy<D> {
        MotionCopy {
            displacement: self.displacement.to_vec(),
            compensation: self.compensation.to_vec(),
            velocity: self.velocity.to_vec(),
        }
    }

    /// Returns displacement, rounding error and velocity of a node.
    pub(crate) fn state(&self, node: u32) -> NodeState<D> {
        let node = node as usize;
        [
            self.displacement[node],
            self.compensation[node],
            self.velocity[node],
        ]
    }

    /// Sets displacement, rounding error and velocity of a node.
    pub(crate) fn set_state(&mut self, node: u32, state: NodeState<D>) {
        let node = node as usize;
        [
            self.displacement[node],
            self.compensation[node],
            self.velocity[node],
        ] = state;
    }

    /// Returns the current positions.
    pub(crate) fn positions(&self) -> Positions<'_, D> {
        Positions::new(self.rest, self.displacement)
    }

    /// Moves `nodes` for `duration`, s, at constant velocities.
    pub(crate) fn drift(&mut self, nodes: &[u32], duration: f64) {
        for &node in nodes {
            let node = node as usize;
            let (displacement, compensation) =
                (&mut self.displacement[node], &mut self.compensation[node]);
            drift_node(displacement, compensation, &self.velocity[node], duration);
        }
    }
}

/// Moves a node for `duration`, s, at a constant velocity. The sums are compensated: plain ones
/// drift 1e-11 over a million substeps.
#[inline]
pub(crate) fn drift_node<const D: usize>(
    displacement: &mut [f64; D],
    compensation: &mut [f64; D],
    velocity: &[f64; D],
    duration: f64,
) {
    for c in 0..D {
        let old = displacement[c];
        let change = duration * velocity[c] - compensation[c];
        let new = old + change;
        compensation[c] = (new - old) - change;
        displacement[c] = new;
    }
}
