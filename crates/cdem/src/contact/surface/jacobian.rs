//! The Jacobian of a contact point.

use crate::math::vector::{add_scaled, dot};

/// Most nodes of a contact constraint: two edges, each from a corner of a quadrilateral to the mean
/// of its four.
pub(crate) const MAX_NODES: usize = 8;

/// Linear map from nodal velocities to the relative velocity of the two points of a contact, row by
/// row: normal first, then the tangents.
///
/// The velocity of the target is that of its material *at the main point*, with the rotation of the
/// feature. Impulses act by the transpose, so that linear and angular momentum are conserved at any
/// gap (design, section 5).
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactJacobian<const D: usize> {
    /// Number of nodes in use.
    pub(crate) count: usize,
    /// Numbers of the nodes.
    pub(crate) nodes: [u32; MAX_NODES],
    /// `rows[k][r]`: coefficients of the velocity of node k in row r.
    pub(crate) rows: [[[f64; D]; D]; MAX_NODES],
    /// Directions of the rows in space: normal, then tangents.
    pub(crate) frame: [[f64; D]; D],
    /// Offset main point − anchored target point in the frame, m.
    pub(crate) offset: [f64; D],
}

impl<const D: usize> Default for ContactJacobian<D> {
    /// Makes a Jacobian without nodes.
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
    /// Returns the nodes in use.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Returns the relative velocity of row `r`, m/s.
    pub(crate) fn relative_velocity(&self, r: usize, velocity: &[[f64; D]]) -> f64 {
        let nodes = self.nodes().iter().enumerate();
        nodes
            .map(|(k, &node)| dot(&self.rows[k][r], &velocity[node as usize]))
            .sum()
    }

    /// Returns the quadratic change of the gap in a drift of `drift` seconds at these velocities, m:
    /// the part that the velocity of the gap at its start does not give, ½ J̇v δ². The gap is `gap` at
    /// its end, m.
    pub(crate) fn quadratic_change(&self, gap: f64, velocity: &[[f64; D]], drift: f64) -> f64 {
        gap - self.offset[0] - drift * self.relative_velocity(0, velocity)
    }

    /// Returns the relative velocity of all rows, m/s.
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

    /// Calls `on_impulse` with each node and its impulse, N s, for an `impulse` in the frame.
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
