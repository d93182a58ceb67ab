//! Visits of the contacts of a [system](crate::contact::solver::system::ContactSystem) in a
//! coloured pass.

use pulp::Simd;

use crate::contact::solver::coloured_pass::{NodeValues, Visit, larger};
use crate::contact::solver::contact_rows::{ConstraintRows, ContactRows};
use crate::contact::solver::simd_block::SimdBlock;

/// Gauss–Seidel visit of a contact, after the velocities have moved by `ratio` along the
/// directions.
pub(super) struct SweepVisit<'a, const D: usize, P> {
    pub(super) terms: &'a ConstraintRows<D, P>,
    pub(super) ratio: f64,
}

impl<const D: usize, P: SimdBlock> Visit<ContactRows<D>, P, 3> for SweepVisit<'_, D, P> {
    #[inline(always)]
    fn visit<S: Simd>(
        &self,
        simd: S,
        _: usize,
        point: &mut ContactRows<D>,
        mut velocity: NodeValues<P>,
    ) -> [f64; 3] {
        let relative = self.terms.relative(point, &velocity);
        let old = point.advance(self.ratio);
        let (impulse, change) = point.local_solve(&old, &relative);
        let mut step = [0.0; D];
        // Number by number: a read of a part waits for the write of the whole.
        for r in 0..D {
            step[r] = impulse[r] - old[r];
            (point.impulse[r], point.step[r]) = (impulse[r], step[r]);
        }
        if step != [0.0; D] {
            self.terms.push(simd, point, &step, &mut velocity);
        }
        let normal = impulse[0].abs().max(point.impulse_before[0].abs());
        [
            change,
            normal * point.inverse_effective_mass[0],
            point.square(&step),
        ]
    }

    #[inline(always)]
    fn together(one: [f64; 3], other: [f64; 3]) -> [f64; 3] {
        [
            larger(one[0], other[0]),
            larger(one[1], other[1]),
            one[2] + other[2],
        ]
    }
}

/// Visit that adds the response to an impulse.
pub(super) struct ApplyImpulse<'a, const D: usize, P, F> {
    pub(super) terms: &'a ConstraintRows<D, P>,
    pub(super) impulse: F,
}

impl<const D: usize, P: SimdBlock, F> Visit<ContactRows<D>, P, 0> for ApplyImpulse<'_, D, P, F>
where
    F: Fn(usize, &mut ContactRows<D>) -> [f64; D] + Sync,
{
    #[inline(always)]
    fn visit<S: Simd>(
        &self,
        simd: S,
        place: usize,
        point: &mut ContactRows<D>,
        mut velocity: NodeValues<P>,
    ) -> [f64; 0] {
        let impulse = (self.impulse)(place, point);
        self.terms.push(simd, point, &impulse, &mut velocity);
        []
    }
}

/// Visit that computes a relative velocity.
pub(super) struct RelativeVelocityVisit<'a, const D: usize, P> {
    pub(super) terms: &'a ConstraintRows<D, P>,
    pub(super) points: &'a [ContactRows<D>],
}

impl<const D: usize, P: SimdBlock> Visit<[f64; D], P, 0> for RelativeVelocityVisit<'_, D, P> {
    #[inline(always)]
    fn visit<S: Simd>(
        &self,
        _: S,
        place: usize,
        own: &mut [f64; D],
        velocity: NodeValues<P>,
    ) -> [f64; 0] {
        *own = self.terms.relative(&self.points[place], &velocity);
        []
    }
}

/// Visit that adds the response to an impulse computed from a value of the contact.
pub(super) struct ResponseVisit<'a, const D: usize, P, F> {
    pub(super) terms: &'a ConstraintRows<D, P>,
    pub(super) points: &'a [ContactRows<D>],
    pub(super) direct: F,
}

impl<const D: usize, P: SimdBlock, T, F> Visit<T, P, 1> for ResponseVisit<'_, D, P, F>
where
    F: Fn(usize, &mut T) -> ([f64; D], f64) + Sync,
{
    #[inline(always)]
    fn visit<S: Simd>(
        &self,
        simd: S,
        place: usize,
        own: &mut T,
        mut velocity: NodeValues<P>,
    ) -> [f64; 1] {
        let (impulse, size) = (self.direct)(place, own);
        let point = &self.points[place];
        self.terms.push(simd, point, &impulse, &mut velocity);
        [size]
    }
}
