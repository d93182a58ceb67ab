//! Solve of an island for its contact impulses, on velocities (design, section 5).
//!
//! Phases of a solve:
//! 1. Projected symmetric Gauss–Seidel: sweeps over the contacts, forwards and backwards in turn.
//!    A visit gives a contact the impulse that meets its target, cut back to its bounds.
//! 2. After the first [`PLAIN_SWEEPS`], a step of nonlinear conjugate gradients \[Silcowitz2010\]
//!    follows each sweep: impulses and velocities move on along the last search direction. It
//!    restarts where the change of a sweep has grown.
//! 3. Active-set CG, where sweeps stall: every [`STALL_SWEEPS`] sweeps, if the residual is above
//!    [`STALL_RATIO`] of that at the check before. At most [`CG_STEPS`] steps; the limit doubles
//!    each time, at most [`LONGEST_CG_DOUBLING`] times. Then the sweeps go on. The solve is given
//!    up after [`CG_TRIES`] in a row that have not brought the residual to [`CG_WORTH`] of the best:
//!    contact points contradict each other.
//!
//! A solve ends after a pair of sweeps, there and back, whose last one changes relative velocities
//! by round-off only, or by no more than a [residual](Precision). Most solves reach the exact one in
//! a few sweeps. After [`EXACT_SWEEPS`] a larger one is sufficient, because the next kick goes on
//! from there: see [`KICK_RESIDUAL`] and [`IMPACT_RESIDUAL`].

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::solver::Precision;
use crate::contact::solver::coloured_pass::PassOrder;
use crate::contact::solver::simd_block::SimdBlock;
use crate::contact::solver::system::{ContactSystem, SweepResult};
use crate::contact::tolerances::{
    CG_STEPS, CG_TRIES, CG_WORTH, EXACT_SWEEPS, LONGEST_CG_DOUBLING, MAX_SWEEPS, PLAIN_SWEEPS,
    RESIDUAL, SOLVE_ROUND_OFF, STALL_RATIO, STALL_SWEEPS,
};

impl<const D: usize, P: SimdBlock> ContactSystem<D, P> {
    /// Finds the impulses of the loaded constraints and adds them to the velocities. Returns the
    /// residual: the largest change of a relative velocity in the last sweep, over the largest
    /// relative velocity that a normal impulse makes.
    pub(crate) fn solve(
        &mut self,
        constraints: &mut [Constraint<D>],
        velocity: &mut [[f64; D]],
        precision: Precision,
    ) -> f64 {
        self.begin(constraints, |node| velocity[node as usize]);
        let residual = self.iterate(precision);
        self.end();
        for (node, solved) in self.velocities() {
            velocity[node as usize] = solved;
        }
        for point in &self.points {
            constraints[point.number as usize].impulse = point.impulse;
        }
        residual
    }

    /// Solves for nodes at rest. Returns the nodes that move and their velocities, m/s.
    pub(crate) fn solve_from_rest(
        &mut self,
        constraints: &[Constraint<D>],
        precision: Precision,
    ) -> Vec<(u32, [f64; D])> {
        self.begin(constraints, |_| [0.0; D]);
        self.iterate(precision);
        self.end();
        self.velocities().collect()
    }

    /// Finds the impulses. Returns the residual, infinite if it is not a number.
    fn iterate(&mut self, precision: Precision) -> f64 {
        let least = precision.velocity.max(SOLVE_ROUND_OFF * self.fastest());
        let (mut first_scale, mut square_before) = (0.0, 0.0);
        let mut stall = Stall::new();
        let mut effort = 0;
        for number in 1.. {
            let order = if number % 2 == 1 {
                PassOrder::Forwards
            } else {
                PassOrder::Backwards
            };
            let SweepResult {
                change,
                scale,
                square,
            } = self.sweep(order);
            effort += 1;
            if !(change + scale).is_finite() {
                return f64::INFINITY; // the run stops at the end of the step
            }
            if number == 2 {
                first_scale = scale;
            }
            let residual = if change <= least { 0.0 } else { change / scale };
            let done = if effort < EXACT_SWEEPS {
                RESIDUAL
            } else {
                precision.residual
            };
            let is_over = residual <= done || stall.is_hopeless();
            if number % 2 == 0 && is_over || effort >= MAX_SWEEPS {
                return residual;
            }
            if number % STALL_SWEEPS == 0 && stall.is_met(residual) {
                let steps = stall.steps().min(MAX_SWEEPS - effort);
                effort += self.descend(steps, least.max(RESIDUAL * scale), first_scale);
                square_before = 0.0;
                self.forget_directions();
            } else if number == PLAIN_SWEEPS {
                self.forget_directions();
            } else if number > PLAIN_SWEEPS {
                let goes_on = square <= square_before && square_before > 0.0;
                self.advance(if goes_on { square / square_before } else { 0.0 });
                square_before = square;
            }
        }
        unreachable!("the number of sweeps is bounded")
    }
}

/// Progress of the sweeps, by which they are found to stall.
struct Stall {
    /// Residual at the last check, and the least one at which a descent began.
    last: f64,
    best: f64,
    /// Descents in a row that were not worth it, and doublings of their steps.
    failed_tries: u32,
    doublings: u32,
}

impl Stall {
    fn new() -> Self {
        Self {
            last: f64::INFINITY,
            best: f64::INFINITY,
            failed_tries: 0,
            doublings: 0,
        }
    }

    /// Returns true if descents are not worth it.
    fn is_hopeless(&self) -> bool {
        self.failed_tries >= CG_TRIES
    }

    /// Returns true if the sweeps have stalled at this residual, and a descent is worth it.
    fn is_met(&mut self, residual: f64) -> bool {
        let before = std::mem::replace(&mut self.last, residual);
        if residual <= STALL_RATIO * before {
            return false;
        }
        self.failed_tries = if residual <= CG_WORTH * self.best {
            0
        } else {
            self.failed_tries + 1
        };
        self.best = self.best.min(residual);
        self.last = f64::INFINITY;
        !self.is_hopeless()
    }

    /// Returns the most steps of the next descent.
    fn steps(&mut self) -> u32 {
        let steps = CG_STEPS << self.doublings;
        self.doublings = LONGEST_CG_DOUBLING.min(self.doublings + 1);
        steps
    }
}
