//! Solve of an island for its contact impulses, on velocities (design, section 5).
//!
//! Phases of a solve:
//! 1. Projected Gauss–Seidel sweeps, from the start: each contact in turn gets the impulse that
//!    meets its target, cut back to its bounds.
//! 2. A nonlinear CG step \[Silcowitz2010\] after each sweep: impulses and velocities move on
//!    along the last search direction. It restarts where the change of a sweep has grown.
//! 3. Active-set CG, where sweeps stall: every [`STALL_SWEEPS`] sweeps, if the residual is
//!    above [`STALL_RATIO`] of that at the check before. It starts from the best impulses so
//!    far. At most [`CG_STEPS`] steps; the limit doubles each time, at most
//!    [`LONGEST_CG_DOUBLING`] times. Then the sweeps go on.
//! 4. The proximal term, of weight [`PROXIMAL_WEIGHT`], once [`CG_TRIES`] stalls in a row have
//!    not brought the residual to [`CG_WORTH`] of the best, or only [`LAST_SWEEPS`] sweeps
//!    remain. No active-set CG from then on, and at most [`LAST_SWEEPS`] sweeps.
//!
//! Deactivation of converged contacts, only in islands of more than [`FEW_CONTACTS`] contacts:
//! a sweep over all contacts finds those that still change; phases 1 to 4 go on with these, and
//! drop more as they converge; then comes a sweep over all again. If that has not brought the
//! residual to [`CG_WORTH`] of the last such sweep, no contact is deactivated any more.
//!
//! A solve ends at its residual, or after [`MAX_SWEEPS`] sweeps and CG steps.

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::solver::Precision;
use crate::contact::solver::simd_block::SimdBlock;
use crate::contact::solver::system::{ContactSystem, SweepResult};
use crate::contact::tolerances::{
    CG_STEPS, CG_TRIES, CG_WORTH, CONVERGED_FRACTION, FEW_CONTACTS, LAST_SWEEPS,
    LONGEST_CG_DOUBLING, MAX_SWEEPS, PROXIMAL_WEIGHT, SOLVE_ROUND_OFF, STALL_RATIO, STALL_SWEEPS,
};
use crate::math::vector::sub;

impl<const D: usize, P: SimdBlock> ContactSystem<D, P> {
    /// Finds the impulses of the loaded constraints and adds them to the velocities. Returns the
    /// residual:
    /// the largest change of a relative velocity in the last sweep, or the largest error that
    /// the proximal term leaves, over the largest relative velocity that a normal impulse
    /// makes.
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

    /// Finds the impulses. Returns the residual.
    fn iterate(&mut self, precision: Precision) -> f64 {
        let mut progress = SolveProgress {
            done: precision.residual,
            least: precision.velocity.max(SOLVE_ROUND_OFF * self.fastest()),
            ..SolveProgress::default()
        };
        self.activate_all();
        let (residual, scale) = if self.points.len() <= FEW_CONTACTS {
            self.iterate_active(&mut progress, 0.0)
        } else {
            self.activate_and_iterate(&mut progress)
        };
        if residual.is_nan() {
            return f64::INFINITY; // the run stops at the end of the step
        }
        if progress.proximal_weight == 0.0 {
            return residual;
        }
        let points = self.points.iter();
        let missed = points.map(|point| point.residual(progress.proximal_weight));
        residual.max(missed.fold(0.0, f64::max) / scale)
    }

    /// Solves a large island: alternates a sweep over all contacts with [`Self::iterate_active`],
    /// which deactivates converged ones. Ends with a sweep over all. Returns its residual and its
    /// scale, m/s.
    fn activate_and_iterate(&mut self, progress: &mut SolveProgress) -> (f64, f64) {
        progress.deactivation_threshold = CONVERGED_FRACTION * progress.done;
        let mut before = f64::INFINITY;
        loop {
            self.activate_all();
            let (residual, SweepResult { scale, .. }) = self.sweep_to(progress);
            progress.effort += 1;
            if residual.is_nan() || residual <= progress.done || progress.is_over() {
                return (residual, scale);
            }
            // Contacts that contradict each other would reactivate each other forever.
            if residual > CG_WORTH * before {
                progress.deactivation_threshold = 0.0;
            }
            before = residual;
            self.iterate_active(progress, scale);
        }
    }

    /// Runs phases 1 to 4 with the active contacts until their residual is met or the solve is
    /// over. Deactivates contacts as they converge. `scale` is that of all contacts, m/s.
    /// Returns the residual and the scale of the last sweep.
    fn iterate_active(&mut self, progress: &mut SolveProgress, scale: f64) -> (f64, f64) {
        let (done, least) = (progress.done, progress.least);
        let mut directions = std::mem::take(&mut self.directions);
        directions.begin(self);
        self.deactivate_converged(progress.deactivation_threshold * scale);
        let (mut sweeps, mut last, mut best) = (0, f64::INFINITY, f64::INFINITY);
        let mut failed_tries = 0;
        let last_sweep = loop {
            let (of_own, swept) = self.sweep_to(progress);
            let own = swept.scale;
            let (residual, scale) = (of_own * own / own.max(scale), own.max(scale));
            progress.effort += 1;
            progress.proximal_sweeps += u32::from(progress.proximal_weight > 0.0);
            sweeps += 1;
            if residual.is_nan() || residual <= done || progress.is_over() {
                break (residual, scale);
            }
            let is_check = sweeps % STALL_SWEEPS == 0;
            if progress.proximal_weight > 0.0 || !is_check || residual <= STALL_RATIO * last {
                last = if is_check { residual } else { last };
                // The first sweep after active-set CG may change contacts that the next one
                // changes back.
                if sweeps > 1 {
                    self.deactivate_converged(progress.deactivation_threshold * scale);
                }
                directions.advance(self, swept.square);
                continue;
            }
            failed_tries = if residual <= CG_WORTH * best {
                0
            } else {
                failed_tries + 1
            };
            if residual <= best {
                best = residual;
                directions.keep(self);
            } else {
                directions.restore(self);
            }
            let left = (MAX_SWEEPS - LAST_SWEEPS).saturating_sub(progress.effort);
            if failed_tries < CG_TRIES && left > 0 {
                let steps = left.min(CG_STEPS << progress.cg_doublings);
                progress.effort += self.descend(steps, least.max(done * scale), scale);
                progress.cg_doublings = LONGEST_CG_DOUBLING.min(progress.cg_doublings + 1);
            } else {
                // All contacts take part in the last sweeps, until they converge again.
                progress.proximal_weight = PROXIMAL_WEIGHT;
                self.activate_all();
            }
            directions.begin(self);
            (sweeps, last) = (0, f64::INFINITY);
        };
        self.directions = directions;
        last_sweep
    }

    /// Runs a sweep. Returns its residual, and its result. The residual is NaN if a change is
    /// not finite, and at most `done` if the change is round-off.
    fn sweep_to(&mut self, progress: &SolveProgress) -> (f64, SweepResult) {
        let swept = self.sweep(progress.proximal_weight);
        let SweepResult { change, scale, .. } = swept;
        let residual = if !(change + scale).is_finite() {
            f64::NAN
        } else if change <= progress.least {
            (change / scale).min(progress.done) // a ratio of round-off means nothing
        } else {
            change / scale
        };
        (residual, swept)
    }
}

/// Goal and progress of a solve.
#[derive(Clone, Copy, Debug, Default)]
struct SolveProgress {
    /// Residual to reach, and the change of a relative velocity that counts as none, m/s.
    done: f64,
    least: f64,
    /// Change of relative velocity below which a contact is deactivated, over the scale.
    deactivation_threshold: f64,
    /// The number of sweeps and CG steps.
    effort: u32,
    /// The number of times that the limit of CG steps has doubled.
    cg_doublings: u32,
    proximal_weight: f64,
    /// The number of sweeps with the proximal term.
    proximal_sweeps: u32,
}

impl SolveProgress {
    /// True if the solve must stop.
    fn is_over(&self) -> bool {
        self.proximal_sweeps >= LAST_SWEEPS || self.effort >= MAX_SWEEPS
    }
}

/// State of the search between sweeps.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchDirections<const D: usize> {
    /// Square of the change in the last sweep, J.
    square: f64,
    /// Best impulses so far, by contact position, N·s.
    kept: Vec<[f64; D]>,
}

impl<const D: usize> SearchDirections<D> {
    fn begin<P: SimdBlock>(&mut self, system: &mut ContactSystem<D, P>) {
        self.kept.resize(system.points.len(), [0.0; D]);
        self.square = 0.0;
        system.forget_directions();
    }

    fn keep<P: SimdBlock>(&mut self, system: &ContactSystem<D, P>) {
        for (place, point) in system.active() {
            self.kept[place] = point.impulse;
        }
    }

    fn restore<P: SimdBlock>(&self, system: &mut ContactSystem<D, P>) {
        system.add(|place, point| sub(&self.kept[place], &point.impulse));
    }

    /// Moves on along the last direction after a sweep. `square` is the square of the change in
    /// that sweep, which takes the role of a gradient.
    fn advance<P: SimdBlock>(&mut self, system: &mut ContactSystem<D, P>, square: f64) {
        // A change that grows means that contacts have reached or left their bounds: restart.
        let goes_on = square <= self.square && self.square > 0.0;
        let ratio = if goes_on { square / self.square } else { 0.0 };
        self.square = square;
        system.advance(ratio);
    }
}
