//! The Jacobian of a contact point.

use crate::math::vector::{add_scaled, dot};

/// Nodes that a contact constraint touches at most: two edges, each from a
/// corner of a quadrilateral to the mean of its four.
pub(crate) const MAX_NODES: usize = 8;

/// Relative velocity of the two points of a contact as a linear map of nodal
/// velocities, row by row: normal first, then the tangents.
///
/// The target's velocity is that of its material *at the main point*, rotation
/// of the feature included; impulses act by the transpose, so that neither
/// momentum changes at any gap (design, section 5).
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactJacobian<const D: usize> {
    /// Nodes in use.
    pub(crate) count: usize,
    /// Their numbers.
    pub(crate) nodes: [u32; MAX_NODES],
    /// `rows[k][r]`: what node k's velocity adds to row r.
    pub(crate) rows: [[[f64; D]; D]; MAX_NODES],
    /// Row vectors in space: normal, then tangents.
    pub(crate) frame: [[f64; D]; D],
    /// Offset main point − anchored target point in the frame, m.
    pub(crate) offset: [f64; D],
}

impl<const D: usize> Default for ContactJacobian<D> {
    /// Of no nodes.
    fn default() -> Self {
        Self {
            count: 0,
            nodes: [0; MAX_NODES],
            rows: [[[0.0; D]; D]; MAX_NODES],
            frame: [[0.0; D]; D],
            offset: [0.0; D],
        }
    }
}

impl<const D: usize> ContactJacobian<D> {
    /// The nodes in use.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Relative velocity of row `r`, m/s.
    pub(crate) fn relative_velocity(&self, r: usize, velocity: &[[f64; D]]) -> f64 {
        let nodes = self.nodes().iter().enumerate();
        nodes
            .map(|(k, &node)| dot(&self.rows[k][r], &velocity[node as usize]))
            .sum()
    }

    /// Relative velocity of all rows, m/s.
    pub(crate) fn relative_velocities(&self, velocity: &[[f64; D]]) -> [f64; D] {
        let mut relative = [0.0; D];
        for (&node, rows) in self.nodes().iter().zip(&self.rows) {
            let velocity = &velocity[node as usize];
            for r in 0..D {
                relative[r] += dot(&rows[r], velocity);
            }
        }
        relative
    }

    /// Calls `receive` with the impulse on each node, N·s, of one in the frame.
    pub(crate) fn apply_transpose(
        &self,
        impulse: &[f64; D],
        mut on_impulse: impl FnMut(u32, &[f64; D]),
    ) {
        for (&node, rows) in self.nodes().iter().zip(&self.rows) {
            let mut on = [0.0; D];
            for r in 0..D {
                add_scaled(&mut on, impulse[r], &rows[r]);
            }
            on_impulse(node, &on);
        }
    }
}
