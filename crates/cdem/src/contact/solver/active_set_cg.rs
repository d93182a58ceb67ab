//! Conjugate gradients on a face of the bounds: for contacts of known state the
//! impulses solve linear equations.
//!
//! Sweeps crawl where contacts say nearly the same: two points that all but
//! coincide, flush faces with more points than freedoms. Their equations have a
//! few eigenvalues near zero, which conjugate gradients take one by one; and
//! where contacts contradict each other a little, directions that change no
//! velocity, along which impulses move until a contact opens or slips. To go to
//! the next bound and on from there along the smaller face is the way of active
//! sets \[Dostal2005\]; to let sweeps free what is bound in error, that of subspace
//! minimisation \[Silcowitz2010\].

use pulp::Scalar;

use crate::contact::constraint::contact_constraint::FrictionBounds;
use crate::contact::solver::simd_block::{BlockFactors, SimdBlock};
use crate::contact::solver::system::ContactSystem;
use crate::contact::tolerances::{LARGEST_GROWTH, LEAST_CURVATURE};
use crate::math::vector::{add_scaled, dot};

/// Scratch: a value for each contact, or pack of nodes; those in use are of contacts awake.
#[derive(Clone, Debug, Default)]
pub(super) struct ActiveSetCg<const D: usize, P> {
    /// Packs of the contacts awake.
    packs: Vec<u32>,
    /// Rows whose impulse lies within its bounds.
    free: Vec<[bool; D]>,
    /// Velocities that are missing in free rows, m/s.
    missing: Vec<[f64; D]>,
    /// Direction of search, N·s; what it does to the relative velocities in free
    /// rows and to the packs, m/s.
    direction: Vec<[f64; D]>,
    response: Vec<[f64; D]>,
    velocity: Vec<P>,
    /// Last square of the missing velocities, J; 0: begins anew.
    square: f64,
}

/// Which bound ends a step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum StepBound {
    Open(usize),
    Slip(usize),
}

impl<const D: usize, P: SimdBlock> ContactSystem<D, P> {
    /// Moves impulses within their bounds towards those with which all contacts
    /// that hold have the velocity they ask for: `steps` steps of conjugate
    /// gradients at most, each of the cost of a sweep. Shear at its limit stays
    /// as it is. Velocities that miss less than a tenth of `least` are right;
    /// `scale` is that of all, m/s. Returns the steps made.
    pub(super) fn descend(&mut self, steps: u32, least: f64, scale: f64) -> u32 {
        let mut face = std::mem::take(&mut self.face);
        face.enter(self);
        let mut made = 0;
        while made < steps && face.worst(self) > 0.1 * least {
            made += 1;
            let (descent, steepest) = face.turn(self);
            let (bound, end) = face.bound(self);
            let step = descent.min(bound);
            if step * steepest > LARGEST_GROWTH * scale {
                break;
            }
            face.advance(self, step);
            if let Some(end) = end.filter(|_| bound <= descent) {
                face.stop(self, end);
            }
        }
        self.face = face;
        made
    }
}

impl<const D: usize, P: SimdBlock> ActiveSetCg<D, P> {
    /// The face of the impulses as they are, and what is missing on it.
    fn enter(&mut self, system: &mut ContactSystem<D, P>) {
        let count = system.points.len();
        self.square = 0.0;
        self.free.resize(count, [false; D]);
        self.missing.resize(count, [0.0; D]);
        self.direction.resize(count, [0.0; D]);
        self.response.resize(count, [0.0; D]);
        self.velocity.resize(system.velocity.len(), P::default());
        system.active_blocks(&mut self.packs);
        let mut velocity = std::mem::take(&mut system.velocity);
        system.relative_velocities(&mut velocity, &mut self.response);
        system.velocity = velocity;
        for (place, point) in system.active() {
            let opens = point.impulse[0] <= -point.limit.tension;
            let slips = point.limit.slips(&point.impulse);
            let free = std::array::from_fn(|r| point.moves(r) && !opens && (r == 0 || !slips));
            let relative = &self.response[place];
            self.missing[place] = std::array::from_fn(|r| {
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

    /// The largest velocity that is missing, m/s.
    fn worst(&self, system: &ContactSystem<D, P>) -> f64 {
        let missing = system.active().flat_map(|(place, _)| &self.missing[place]);
        missing.fold(0.0, |worst, x| worst.max(x.abs()))
    }

    /// The next direction. Returns the step to its lowest point and the largest
    /// velocity that a contact's part of it makes alone, m/s.
    fn turn(&mut self, system: &ContactSystem<D, P>) -> (f64, f64) {
        let mut square = 0.0;
        for (place, point) in system.active() {
            let (missing, compliance) = (&self.missing[place], &point.compliance);
            for r in (0..D).filter(|&r| missing[r] != 0.0) {
                square += missing[r] * missing[r] / compliance[r.min(1)];
            }
        }
        let ratio = if self.square > 0.0 {
            square / self.square
        } else {
            0.0
        };
        self.square = square;
        for &pack in &self.packs {
            self.velocity[pack as usize] = P::default();
        }
        let missing = &self.missing;
        let turn = |place: usize, direction: &mut [f64; D]| {
            let (missing, compliance) = (&missing[place], &system.points[place].compliance);
            let mut steepest = 0.0_f64;
            for r in 0..D {
                let alone = if missing[r] == 0.0 {
                    0.0
                } else {
                    missing[r] / compliance[r.min(1)]
                };
                direction[r] = alone + ratio * direction[r];
                steepest = steepest.max(direction[r].abs() * compliance[r.min(1)]);
            }
            (*direction, steepest)
        };
        let steepest = system.respond(&mut self.direction, &mut self.velocity, turn);
        system.relative_velocities(&mut self.velocity, &mut self.response);
        let (mut own, mut curvature) = (0.0, 0.0);
        for (place, point) in system.active() {
            let (direction, response) = (&self.direction[place], &self.response[place]);
            for r in 0..D {
                own += direction[r] * direction[r] * point.compliance[r.min(1)];
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

    /// The step at which a first contact comes to a bound, and which.
    fn bound(&self, system: &ContactSystem<D, P>) -> (f64, Option<StepBound>) {
        let mut first = (f64::INFINITY, None);
        for (place, point) in system.active() {
            let (free, direction) = (&self.free[place], &self.direction[place]);
            if free[0] && direction[0] < 0.0 {
                let step = (-point.limit.tension - point.impulse[0]) / direction[0];
                if step < first.0 {
                    first = (step, Some(StepBound::Open(place)));
                }
            }
            if free[1..].contains(&true) {
                let step = step_to_slip(&point.limit, &point.impulse, direction);
                if step < first.0 {
                    first = (step, Some(StepBound::Slip(place)));
                }
            }
        }
        first
    }

    fn advance(&mut self, system: &mut ContactSystem<D, P>, step: f64) {
        let (points, awake) = (&mut system.points, system.colours.active());
        for place in awake.iter().map(|&place| place as usize) {
            add_scaled(&mut points[place].impulse, step, &self.direction[place]);
            for r in (0..D).filter(|&r| self.free[place][r]) {
                self.missing[place][r] -= step * self.response[place][r];
            }
        }
        let step = BlockFactors::new(Scalar::new(), &[step]);
        for pack in self.packs.iter().map(|&pack| pack as usize) {
            let made = std::array::from_ref(&self.velocity[pack]);
            system.velocity[pack].add_scaled(Scalar::new(), &step, made);
        }
    }

    /// Leaves a contact at its bound, and begins anew on the smaller face.
    fn stop(&mut self, system: &mut ContactSystem<D, P>, end: StepBound) {
        let (place, first) = match end {
            StepBound::Open(place) => (place, 0),
            StepBound::Slip(place) => (place, 1),
        };
        if first == 0 {
            let point = &system.points[place];
            let mut rest = [0.0; D];
            rest[0] = -point.limit.tension - point.impulse[0];
            system.add_to(place, &rest);
        }
        self.free[place][first..].fill(false);
        self.missing[place][first..].fill(0.0);
        self.square = 0.0;
    }
}

/// How far an impulse may go along a direction until its shear is at the limit:
/// the first root of |s + αd| = μ (n + αe) + c.
fn step_to_slip<const D: usize>(
    limit: &FrictionBounds,
    impulse: &[f64; D],
    direction: &[f64; D],
) -> f64 {
    let (bound, growth) = (limit.shear_bound(impulse[0]), limit.friction * direction[0]);
    let shear = |a: &[f64; D], b: &[f64; D]| (1..D).map(|r| a[r] * b[r]).sum::<f64>();
    let a = shear(direction, direction) - growth * growth;
    let b = shear(impulse, direction) - bound * growth;
    let c = (bound * bound - shear(impulse, impulse)).max(0.0);
    let divisor = b + (b * b + a * c).max(0.0).sqrt();
    // No real root: it never comes there.
    if divisor > 0.0 && b * b + a * c >= 0.0 {
        c / divisor
    } else {
        f64::INFINITY
    }
}
