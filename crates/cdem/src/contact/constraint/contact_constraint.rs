//! Contact constraint: Jacobian, target velocity and friction bounds.

use crate::contact::surface::ContactJacobian;
use crate::math::vector::sub;

/// Bounds of a contact's impulse.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FrictionBounds {
    /// Coulomb: tan φ.
    pub(crate) friction: f64,
    /// Shear impulse carried without normal impulse, c·A·δ, N·s.
    pub(crate) cohesion: f64,
    /// Tensile impulse carried, σ_t·A·δ, N·s; below 0 for a pressure that must stay.
    pub(crate) tension: f64,
}

impl FrictionBounds {
    /// True if the shear of an impulse is at its limit.
    pub(crate) fn slips<const D: usize>(&self, impulse: &[f64; D]) -> bool {
        shear_norm(impulse) >= self.shear_bound(impulse[0]) * (1.0 - 1e-12)
    }

    /// Scales the shear of an impulse down to its limit, (10) of \[Li2015\].
    #[inline(always)]
    pub(crate) fn clamp_shear<const D: usize>(&self, impulse: &mut [f64; D]) {
        let (square, bound) = (shear_square(impulse), self.shear_bound(impulse[0]));
        if square > bound * bound {
            let factor = factor_to_bound(bound, square);
            for r in 1..D {
                impulse[r] *= factor;
            }
        }
    }

    /// Returns the shear limit at a normal impulse, (7) of \[Li2015\], N·s.
    #[inline(always)]
    pub(crate) fn shear_bound(&self, normal: f64) -> f64 {
        (normal * self.friction + self.cohesion).max(0.0)
    }
}

/// Returns the factor that shortens a shear impulse, given by its square, to its bound. Marked
/// cold: most contacts stick, and they must not wait for a square root.
#[cold]
fn factor_to_bound(bound: f64, square: f64) -> f64 {
    bound / square.sqrt()
}

/// Constraint of one contact in a solve.
#[derive(Clone, Debug)]
pub(crate) struct Constraint<const D: usize> {
    /// Relative velocity as a function of nodal velocities.
    pub(crate) jacobian: ContactJacobian<D>,
    /// Target of the relative velocity, row by row, m/s.
    pub(crate) target: [f64; D],
    /// Bounds of the impulse.
    pub(crate) bounds: FrictionBounds,
    /// Impulse in the frame of the Jacobian, N·s: start value in, solution out.
    pub(crate) impulse: [f64; D],
    /// Part of the impulse that the velocities already contain, N·s: in an impact that of the
    /// last kick. The bounds then hold for the sum, and a contact that opens gives back its
    /// shear with its normal impulse.
    pub(crate) impulse_before: [f64; D],
}

impl<const D: usize> Default for Constraint<D> {
    /// Returns a constraint without nodes, target and impulse.
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
    /// Returns the impulse that a solve has added, N·s.
    pub(crate) fn added(&self) -> [f64; D] {
        sub(&self.impulse, &self.impulse_before)
    }

    /// True if the contact carries no more impulse and opens faster than `least`, m/s.
    pub(crate) fn opens(&self, velocity: &[[f64; D]], least: f64) -> bool {
        self.impulse[0] <= -self.bounds.tension
            && self.jacobian.relative_velocity(0, velocity) - self.target[0] > least
    }

    /// True if there is more pressure than must stay.
    pub(crate) fn presses(&self) -> bool {
        self.impulse[0] > (-self.bounds.tension).max(0.0)
    }

    /// True if the shear impulse is at its limit and the tangential velocity still misses its
    /// target by more than `least`, m/s.
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

/// Returns the length of the tangential part.
#[inline(always)]
pub(crate) fn shear_norm<const D: usize>(impulse: &[f64; D]) -> f64 {
    shear_square(impulse).sqrt()
}

/// Returns the square of the length of the tangential part.
#[inline(always)]
pub(crate) fn shear_square<const D: usize>(impulse: &[f64; D]) -> f64 {
    let mut square = 0.0;
    for r in 1..D {
        square += impulse[r] * impulse[r];
    }
    square
}
