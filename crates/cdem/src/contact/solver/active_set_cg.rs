//! Active-set CG: conjugate gradients over the impulses that are within their bounds. For
//! contacts of known state, the impulses solve linear equations.
//!
//! Sweeps converge slowly where contacts are nearly redundant: two points that almost coincide,
//! or flush faces with more points than degrees of freedom. Their equations have a few
//! eigenvalues near zero, which conjugate gradients remove one by one. Where contacts
//! contradict each other a little, there are also directions that change no velocity; impulses
//! move along them until a contact opens or slips. Going to the next bound and on from there
//! with a smaller active set follows \[Dostal2005\]; letting sweeps free impulses that were
//! bound in error follows subspace minimisation \[Silcowitz2010\].

use pulp::Scalar;

use crate::contact::constraint::contact_constraint::FrictionBounds;
use crate::contact::solver::simd_block::{BlockFactors, SimdBlock};
use crate::contact::solver::system::ContactSystem;
use crate::contact::tolerances::{LARGEST_GROWTH, LEAST_CURVATURE};
use crate::math::vector::{add_scaled, dot};

/// Workspace: a value for each contact or SIMD block.
#[derive(Clone, Debug, Default)]
pub(super) struct ActiveSetCg<const D: usize, P> {
    /// True for each row whose impulse is within its bounds.
    free: Vec<[bool; D]>,
    /// Velocity errors in free rows, m/s.
    velocity_errors: Vec<[f64; D]>,
    /// Search direction, N·s; the relative velocities that it makes in all rows, and the
    /// velocities that it makes in SIMD blocks, m/s.
    direction: Vec<[f64; D]>,
    response: Vec<[f64; D]>,
    velocity: Vec<P>,
    /// Last square of the velocity errors, J; 0 to restart.
    square: f64,
}

/// The bound that ends a step, with the position of its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
enum StepBound {
    Open(usize),
    Slip(usize),
}

impl<const D: usize, P: SimdBlock> ContactSystem<D, P> {
    /// Moves impulses within their bounds towards those for which all closed contacts meet
    /// their targets: at most `steps` steps of conjugate gradients, each as costly as a sweep.
    /// Shear at its limit stays as it is. Velocity errors below a tenth of `least`, m/s, count
    /// as none; `scale` is that of all contacts at the start of the solve, m/s. Returns the number
    /// of steps.
    pub(super) fn descend(&mut self, steps: u32, least: f64, scale: f64) -> u32 {
        let mut active_set_cg = std::mem::take(&mut self.active_set_cg);
        active_set_cg.enter(self);
        let (mut made, mut change) = (0, 0.0);
        while made < steps && active_set_cg.worst() > 0.1 * least {
            made += 1;
            let (descent, steepest) = active_set_cg.next_direction(self);
            let (bound, end) = active_set_cg.step_to_bound(self);
            let step = descent.min(bound);
            change += step * steepest;
            if change > LARGEST_GROWTH * scale {
                break;
            }
            active_set_cg.advance(self, step);
            if let Some(end) = end.filter(|_| bound <= descent) {
                active_set_cg.fix_at_bound(self, end);
            }
        }
        self.active_set_cg = active_set_cg;
        made
    }
}

impl<const D: usize, P: SimdBlock> ActiveSetCg<D, P> {
    /// Finds the free rows at the present impulses, and their velocity errors.
    fn enter(&mut self, system: &mut ContactSystem<D, P>) {
        let count = system.points.len();
        self.square = 0.0;
        self.free.resize(count, [false; D]);
        self.velocity_errors.resize(count, [0.0; D]);
        self.direction.resize(count, [0.0; D]);
        self.response.resize(count, [0.0; D]);
        self.velocity.resize(system.velocity.len(), P::default());
        let mut velocity = std::mem::take(&mut system.velocity);
        system.relative_velocities(&mut velocity, &mut self.response);
        system.velocity = velocity;
        for (place, point) in system.points.iter().enumerate() {
            let opens = point.impulse[0] <= -point.bounds.tension;
            let slips = point.bounds.slips(&point.impulse);
            let free = std::array::from_fn(|r| point.moves(r) && !opens && (r == 0 || !slips));
            let relative = &self.response[place];
            self.velocity_errors[place] = std::array::from_fn(|r| {
                if free[r] {
                    point.target[r] - relative[r]
                } else {
                    0.0
                }
            });
            self.free[place] = free;
            self.direction[place] = [0.0; D];
        }
    }

    /// Returns the largest velocity error, m/s.
    fn worst(&self) -> f64 {
        let errors = self.velocity_errors.as_flattened().iter();
        errors.fold(0.0, |worst, x| worst.max(x.abs()))
    }

    /// Computes the next direction. Returns the step to the minimum along it, and the largest
    /// velocity that one contact's component of it makes alone, m/s.
    fn next_direction(&mut self, system: &ContactSystem<D, P>) -> (f64, f64) {
        let mut square = 0.0;
        for (place, point) in system.points.iter().enumerate() {
            let (velocity_errors, inverse_effective_mass) =
                (&self.velocity_errors[place], &point.inverse_effective_mass);
            for r in (0..D).filter(|&r| velocity_errors[r] != 0.0) {
                square +=
                    velocity_errors[r] * velocity_errors[r] / inverse_effective_mass[r.min(1)];
            }
        }
        let ratio = if self.square > 0.0 {
            square / self.square
        } else {
            0.0
        };
        self.square = square;
        self.velocity.fill(P::default());
        let velocity_errors = &self.velocity_errors;
        let next_direction = |place: usize, direction: &mut [f64; D]| {
            let (velocity_errors, inverse_effective_mass) = (
                &velocity_errors[place],
                &system.points[place].inverse_effective_mass,
            );
            let mut steepest = 0.0_f64;
            for r in 0..D {
                let alone = if velocity_errors[r] == 0.0 {
                    0.0
                } else {
                    velocity_errors[r] / inverse_effective_mass[r.min(1)]
                };
                direction[r] = alone + ratio * direction[r];
                steepest = steepest.max(direction[r].abs() * inverse_effective_mass[r.min(1)]);
            }
            (*direction, steepest)
        };
        let steepest = system.respond(&mut self.direction, &mut self.velocity, next_direction);
        system.relative_velocities(&mut self.velocity, &mut self.response);
        let (mut own, mut curvature) = (0.0, 0.0);
        for (place, point) in system.points.iter().enumerate() {
            let (direction, response) = (&self.direction[place], &self.response[place]);
            for r in 0..D {
                own += direction[r] * direction[r] * point.inverse_effective_mass[r.min(1)];
            }
            curvature += dot(response, direction);
        }
        let flat = curvature <= LEAST_CURVATURE * own;
        (
            if flat {
                f64::INFINITY
            } else {
                square / curvature
            },
            steepest,
        )
    }

    /// Returns the step at which the first contact reaches a bound, and that bound.
    fn step_to_bound(&self, system: &ContactSystem<D, P>) -> (f64, Option<StepBound>) {
        let mut first = (f64::INFINITY, None);
        for (place, point) in system.points.iter().enumerate() {
            let (free, direction) = (&self.free[place], &self.direction[place]);
            if free[0] && direction[0] < 0.0 {
                let step = (-point.bounds.tension - point.impulse[0]) / direction[0];
                if step < first.0 {
                    first = (step, Some(StepBound::Open(place)));
                }
            }
            if free[1..].contains(&true) {
                let step = step_to_slip(&point.bounds, &point.impulse, direction);
                if step < first.0 {
                    first = (step, Some(StepBound::Slip(place)));
                }
            }
        }
        first
    }

    fn advance(&mut self, system: &mut ContactSystem<D, P>, step: f64) {
        for (place, point) in system.points.iter_mut().enumerate() {
            add_scaled(&mut point.impulse, step, &self.direction[place]);
            for r in (0..D).filter(|&r| self.free[place][r]) {
                self.velocity_errors[place][r] -= step * self.response[place][r];
            }
        }
        let step = BlockFactors::new(Scalar::new(), &[step]);
        for (velocity, made) in system.velocity.iter_mut().zip(&self.velocity) {
            velocity.add_scaled(Scalar::new(), &step, std::array::from_ref(made));
        }
    }

    /// Fixes a contact at its bound, and restarts with the smaller active set.
    fn fix_at_bound(&mut self, system: &mut ContactSystem<D, P>, end: StepBound) {
        let (place, first) = match end {
            StepBound::Open(place) => (place, 0),
            StepBound::Slip(place) => (place, 1),
        };
        if first == 0 {
            let point = &system.points[place];
            let mut rest = [0.0; D];
            rest[0] = -point.bounds.tension - point.impulse[0];
            system.add_to(place, &rest);
        }
        self.free[place][first..].fill(false);
        self.velocity_errors[place][first..].fill(0.0);
        self.square = 0.0;
    }
}

/// Returns the step along a direction at which the shear of an impulse reaches its limit: the
/// first root of |s + αd| = μ (n + αe) + c.
fn step_to_slip<const D: usize>(
    bounds: &FrictionBounds,
    impulse: &[f64; D],
    direction: &[f64; D],
) -> f64 {
    let (bound, growth) = (
        bounds.shear_bound(impulse[0]),
        bounds.friction * direction[0],
    );
    let shear = |a: &[f64; D], b: &[f64; D]| (1..D).map(|r| a[r] * b[r]).sum::<f64>();
    let a = shear(direction, direction) - growth * growth;
    let b = shear(impulse, direction) - bound * growth;
    let c = (bound * bound - shear(impulse, impulse)).max(0.0);
    let divisor = b + (b * b + a * c).max(0.0).sqrt();
    // Without a real root it never reaches the limit.
    if divisor > 0.0 && b * b + a * c >= 0.0 {
        c / divisor
    } else {
        f64::INFINITY
    }
}
