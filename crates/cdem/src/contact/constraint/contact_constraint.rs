//! A contact constraint: Jacobian, target velocity and bounds of the impulse.

use crate::contact::surface::ContactJacobian;
use crate::math::vector::sub;

/// Bounds of a contact's impulse.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FrictionBounds {
    /// Coulomb: tan φ.
    pub(crate) friction: f64,
    /// Shear impulse carried without normal impulse, c·A·δ, N·s.
    pub(crate) cohesion: f64,
    /// Tensile impulse carried, σ_t·A·δ, N·s.
    pub(crate) tension: f64,
}

impl FrictionBounds {
    /// Whether the shear of an impulse is at its limit.
    pub(crate) fn slips<const D: usize>(&self, impulse: &[f64; D]) -> bool {
        shear_norm(impulse) >= self.shear_bound(impulse[0]) * (1.0 - 1e-12)
    }

    /// Cuts the shear of an impulse back to its limit (10).
    #[inline(always)]
    pub(crate) fn clamp_shear<const D: usize>(&self, impulse: &mut [f64; D]) {
        let (square, bound) = (shear_square(impulse), self.shear_bound(impulse[0]));
        if square > bound * bound {
            let share = share(bound, square);
            for r in 1..D {
                impulse[r] *= share;
            }
        }
    }

    /// The shear limit (7) at a normal impulse, N·s.
    #[inline(always)]
    pub(crate) fn shear_bound(&self, normal: f64) -> f64 {
        (normal * self.friction + self.cohesion).max(0.0)
    }
}

/// What a bound is of a length whose square is known. Most contacts stick: none of those is to
/// wait for a root.
#[cold]
fn share(bound: f64, square: f64) -> f64 {
    bound / square.sqrt()
}

/// One contact of an island.
#[derive(Clone, Debug)]
pub(crate) struct Constraint<const D: usize> {
    /// Relative velocity as a function of nodal velocities.
    pub(crate) jacobian: ContactJacobian<D>,
    /// Relative velocity asked for, row by row, m/s.
    pub(crate) target: [f64; D],
    /// Bounds of the impulse.
    pub(crate) bounds: FrictionBounds,
    /// Impulse in the operator's frame, N·s: start value in, solution out.
    pub(crate) impulse: [f64; D],
    /// What of it the velocities have already: in an impact, the last kick's, so that
    /// the bounds are those of both together, and what a parting contact takes back of
    /// its normal impulse it takes back of its shear.
    pub(crate) impulse_before: [f64; D],
}

impl<const D: usize> Default for Constraint<D> {
    /// Of no nodes: nothing is asked of it, and it bears nothing.
    fn default() -> Self {
        Self {
            jacobian: ContactJacobian::default(),
            target: [0.0; D],
            bounds: FrictionBounds::default(),
            impulse: [0.0; D],
            impulse_before: [0.0; D],
        }
    }
}

impl<const D: usize> Constraint<D> {
    /// What a solve has added to the impulse that was borne, N·s.
    pub(crate) fn added(&self) -> [f64; D] {
        sub(&self.impulse, &self.impulse_before)
    }

    /// Whether the contact bears no more, and parts by more than `least`, m/s.
    pub(crate) fn opens(&self, velocity: &[[f64; D]], least: f64) -> bool {
        self.impulse[0] <= -self.bounds.tension
            && self.jacobian.relative_velocity(0, velocity) - self.target[0] > least
    }

    /// Whether the shear impulse is at its limit, and not enough: the tangent
    /// misses the velocity asked for by more than `least`, m/s.
    pub(crate) fn slips(&self, velocity: &[[f64; D]], least: f64) -> bool {
        if !self.bounds.slips(&self.impulse) {
            return false;
        }
        let mut missing = [0.0; D];
        for r in 1..D {
            missing[r] = self.jacobian.relative_velocity(r, velocity) - self.target[r];
        }
        shear_norm(&missing) > least
    }
}

/// Length of the tangential part.
#[inline(always)]
pub(crate) fn shear_norm<const D: usize>(impulse: &[f64; D]) -> f64 {
    shear_square(impulse).sqrt()
}

/// Square of the length of the tangential part.
#[inline(always)]
pub(crate) fn shear_square<const D: usize>(impulse: &[f64; D]) -> f64 {
    let mut square = 0.0;
    for r in 1..D {
        square += impulse[r] * impulse[r];
    }
    square
}
