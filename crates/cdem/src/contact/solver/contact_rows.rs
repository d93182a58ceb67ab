//! Rows of one contact in the solver: its relative velocity from nodal velocities, and the
//! response of these to its impulse.

use std::ops::Range;

use pulp::Simd;

use crate::contact::constraint::contact_constraint::{FrictionBounds, shear_square};
use crate::contact::solver::coloured_pass::NodeValues;
use crate::contact::solver::inverse_mass_columns::{ColumnTerm, InverseMassColumns};
use crate::contact::solver::simd_block::{BlockFactors, SimdBlock, SimdBlocks};
use crate::contact::surface::ContactJacobian;
use crate::math::vector::sub;
use crate::model::inverse_mass::KickMobility;

/// A vector in register width, padded with 0.
pub(super) type PaddedVector = [f64; 4];

/// Returns the components without the padding.
#[inline(always)]
pub(super) fn truncated<const D: usize>(wide: &PaddedVector) -> [f64; D] {
    std::array::from_fn(|c| wide[c])
}

/// Rows of all contacts.
#[derive(Clone, Debug, Default)]
pub(super) struct ConstraintRows<const D: usize, P> {
    /// Jacobians: relative velocities as functions of nodal velocities.
    pub(super) jacobian_terms: Vec<JacobianTerm<D>>,
    /// Responses M⁻¹Jᵀ, 1/kg, for each SIMD block of a contact in turn, row by row.
    pub(super) responses: Vec<[P; D]>,
    /// Instead, where impulses act by columns: the columns of M⁻¹ for each Jacobian term.
    pub(super) column_terms: Vec<ColumnTerm<D>>,
    pub(super) columns: InverseMassColumns<D, P>,
}

/// Part of the relative velocity that one node contributes.
#[derive(Clone, Debug)]
pub(super) struct JacobianTerm<const D: usize> {
    /// Index of the first SIMD block among those of the contact, the lane of the node's first
    /// number in it, and the stride to the next.
    pub(super) slot: u32,
    pub(super) lane: u32,
    pub(super) stride: u32,
    /// Contribution of each component, row by row, so that no sum across a register is needed.
    pub(super) columns: [PaddedVector; D],
}

/// Rows and impulse of a contact.
#[derive(Clone, Debug)]
pub(super) struct ContactRows<const D: usize> {
    /// Index of its constraint.
    pub(super) number: u32,
    /// Its ranges among the terms.
    pub(super) jacobian_terms: Range<usize>,
    pub(super) responses: Range<usize>,
    /// Relative velocity in each row for a unit normal impulse, 1/kg.
    pub(super) by_normal: [f64; D],
    /// Inverse effective mass of the normal and of the tangents, 1/kg; 0 where the lever is short.
    /// One value for all tangents keeps the friction disc a disc.
    pub(super) inverse_effective_mass: [f64; 2],
    /// Effective mass of each row, kg; 0 where its lever is short.
    pub(super) effective_mass: [f64; D],
    pub(super) target: [f64; D],
    pub(super) bounds: FrictionBounds,
    pub(super) impulse: [f64; D],
    pub(super) impulse_before: [f64; D],
    /// Change of the impulse in the last visit, N·s.
    pub(super) step: [f64; D],
    /// Search direction between sweeps, N·s.
    pub(super) direction: [f64; D],
}

/// Returns the nodes of a contact, with their index in the Jacobian and true if all their
/// components are prescribed.
pub(super) fn nodes_of<'a, const D: usize>(
    jacobian: &'a ContactJacobian<D>,
    mobility: KickMobility<'a, D>,
) -> impl Iterator<Item = (usize, u32, bool)> + 'a {
    let nodes = jacobian.nodes().iter().enumerate();
    nodes.map(move |(k, &node)| (k, node, mobility.inertia.is_prescribed(node as usize)))
}

impl<const D: usize, P: SimdBlock> ConstraintRows<D, P> {
    /// Removes the rows of all contacts, but no columns of M⁻¹.
    pub(super) fn clear(&mut self) {
        self.jacobian_terms.clear();
        self.responses.clear();
        self.column_terms.clear();
    }

    /// Returns the relative velocity of a contact, m/s, from the velocities of its nodes.
    #[inline(always)]
    pub(super) fn relative(&self, point: &ContactRows<D>, velocity: &NodeValues<P>) -> [f64; D] {
        // One sum per component, because an addition waits for the one before.
        let mut sums = [[0.0; 4]; D];
        for term in &self.jacobian_terms[point.jacobian_terms.clone()] {
            let [slot, lane, stride] = [term.slot, term.lane, term.stride].map(|n| n as usize);
            let node: [f64; D] = velocity.numbers(slot, lane, stride);
            for c in 0..D {
                for r in 0..4 {
                    sums[c][r] += node[c] * term.columns[c][r];
                }
            }
        }
        let mut sum = sums[0];
        for other in &sums[1..] {
            for r in 0..4 {
                sum[r] += other[r];
            }
        }
        truncated(&sum)
    }

    /// Adds the velocities that an impulse of a contact makes, m/s.
    #[inline(always)]
    pub(super) fn push<S: Simd>(
        &self,
        simd: S,
        point: &ContactRows<D>,
        impulse: &[f64; D],
        velocity: &mut impl SimdBlocks<P>,
    ) {
        if P::BY_COLUMNS {
            for (term, column_term) in self.by_columns(point) {
                let on_node = column_term.on_node(term, impulse);
                column_term.push(simd, &self.columns, &on_node, velocity);
            }
            return;
        }
        let factors = BlockFactors::new(simd, impulse);
        velocity.change(
            &self.responses[point.responses.clone()],
            |simd_block, rows| {
                simd_block.add_scaled(simd, &factors, rows);
            },
        );
    }

    /// Returns the Jacobian terms and column terms of a contact whose impulses act by columns.
    #[inline(always)]
    pub(super) fn by_columns(
        &self,
        point: &ContactRows<D>,
    ) -> impl Iterator<Item = (&JacobianTerm<D>, &ColumnTerm<D>)> {
        let own = point.jacobian_terms.clone();
        self.jacobian_terms[own.clone()]
            .iter()
            .zip(&self.column_terms[own])
    }
}

impl<const D: usize> ContactRows<D> {
    /// True if an impulse in row `r` moves a node.
    pub(super) fn moves(&self, r: usize) -> bool {
        self.effective_mass[r] > 0.0
    }

    /// Returns the energy of a change of the impulse, J.
    #[inline(always)]
    pub(super) fn square(&self, step: &[f64; D]) -> f64 {
        let mut square = 0.0;
        for r in 0..D {
            square += self.inverse_effective_mass[r.min(1)] * step[r] * step[r];
        }
        square
    }

    /// Returns the impulse plus `ratio` times the last search direction. The new search direction
    /// is the change of the impulse since the last call.
    #[inline(always)]
    pub(super) fn advance(&mut self, ratio: f64) -> [f64; D] {
        let mut impulse = self.impulse;
        for r in 0..D {
            let ahead = ratio * self.direction[r];
            self.direction[r] = ahead + self.step[r];
            impulse[r] += ahead;
        }
        impulse
    }

    /// Returns the impulse with which this contact alone would meet its target, from the `old`
    /// impulse and its relative velocity, cut back to its bounds. The normal comes first.
    /// Returns also the square of the largest change of a relative velocity, m²/s².
    #[inline(always)]
    pub(super) fn local_solve(&self, old: &[f64; D], relative: &[f64; D]) -> ([f64; D], f64) {
        let mut impulse = *old;
        let [normal, tangent] = self.inverse_effective_mass;
        if normal > 0.0 {
            let closed = old[0] + (self.target[0] - relative[0]) * self.effective_mass[0];
            // A NaN must remain NaN, so that it is detected.
            let opens = closed < -self.bounds.tension;
            impulse[0] = if opens { -self.bounds.tension } else { closed };
        }
        let push = impulse[0] - old[0];
        let change = (push * normal) * (push * normal);
        let bound = self.bounds.shear_bound(impulse[0]);
        if tangent == 0.0 || (bound == 0.0 && old[1..].iter().all(|&x| x == 0.0)) {
            return (impulse, change);
        }
        for r in 1..D {
            let wanted = self.target[r] - relative[r] - self.by_normal[r] * push;
            impulse[r] += wanted * self.effective_mass[r];
        }
        self.bounds.clamp_shear(&mut impulse);
        let sheared = shear_square(&sub(&impulse, old)) * (tangent * tangent);
        (impulse, if sheared <= change { change } else { sheared })
    }
}
