//! Contacts that share nodes, solved together: projected Gauss–Seidel over an
//! island, on velocities (design, section 5).

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::solver::simd_block::SimdBlock;
use crate::contact::solver::system::{ContactSystem, SweepResult};
use crate::contact::tolerances::{
    CG_STEPS, CG_TRIES, CG_WORTH, CONVERGED_FRACTION, FEW_CONTACTS, LAST_SWEEPS,
    LONGEST_CG_DOUBLING, MAX_SWEEPS, PROXIMAL_WEIGHT, RESIDUAL, SOLVE_ROUND_OFF, STALL_RATIO,
    STALL_SWEEPS,
};
use crate::math::vector::sub;

impl<const D: usize, P: SimdBlock> ContactSystem<D, P> {
    /// Finds the impulses of the constraints that were loaded and adds them to
    /// the velocities. Returns the residual: the largest change of a relative velocity
    /// in the last sweep, or what [`PROXIMAL_WEIGHT`] misses of one, over the largest that
    /// the impulses make. It is done at one of `done`, and a change below `least`, m/s, is
    /// none.
    pub(crate) fn solve(
        &mut self,
        constraints: &mut [Constraint<D>],
        velocity: &mut [[f64; D]],
        (done, least): (f64, f64),
    ) -> f64 {
        self.begin(constraints, |node| velocity[node as usize]);
        let residual = self.iterate(done, least);
        self.end();
        for (node, solved) in self.velocities() {
            velocity[node as usize] = solved;
        }
        for point in &self.points {
            constraints[point.number as usize].impulse = point.impulse;
        }
        residual
    }

    /// The same for nodes at rest: those that are moved, and their velocities, m/s.
    pub(crate) fn solve_from_rest(
        &mut self,
        constraints: &[Constraint<D>],
        least: f64,
    ) -> Vec<(u32, [f64; D])> {
        self.begin(constraints, |_| [0.0; D]);
        self.iterate(RESIDUAL, least);
        self.end();
        self.velocities().collect()
    }

    /// Finds the impulses; returns the residual.
    fn iterate(&mut self, done: f64, least: f64) -> f64 {
        let mut course = SolveProgress {
            done,
            least: least.max(SOLVE_ROUND_OFF * self.fastest()),
            ..SolveProgress::default()
        };
        self.activate_all();
        let (residual, scale) = if self.points.len() <= FEW_CONTACTS {
            self.follow(&mut course, 0.0)
        } else {
            self.activate_and_iterate(&mut course)
        };
        if residual.is_nan() {
            return f64::INFINITY; // the run stops at the end of the step
        }
        if course.reluctance == 0.0 {
            return residual;
        }
        let points = self.points.iter();
        let missed = points.map(|point| point.residual(course.reluctance));
        residual.max(missed.fold(0.0, f64::max) / scale)
    }

    /// A sweep over all contacts tells which are awake: those that it changes. With
    /// these alone the solve goes on until they are right, and begins anew; it ends with
    /// a sweep over all. Returns its residual, and its scale, m/s.
    fn activate_and_iterate(&mut self, course: &mut SolveProgress) -> (f64, f64) {
        course.dozes = CONVERGED_FRACTION * course.done;
        let mut before = f64::INFINITY;
        loop {
            self.activate_all();
            let (residual, SweepResult { scale, .. }) = self.sweep_to(course);
            course.effort += 1;
            if residual.is_nan() || residual <= course.done || course.is_over() {
                return (residual, scale);
            }
            // Contacts that contradict each other would wake each other for ever.
            if residual > CG_WORTH * before {
                course.dozes = 0.0;
            }
            before = residual;
            self.follow(course, scale);
        }
    }

    /// Goes on with the contacts awake until they are right, or the course is over; those
    /// that hardly change, or hardly do any more, fall asleep. `scale` is that of all, m/s.
    /// Returns the residual of the last sweep, and its scale.
    ///
    /// Projected Gauss–Seidel, sped up as nonlinear conjugate gradients
    /// \[Silcowitz2010\] and, where that does not get on, by
    /// descents along the faces of the bounds; where those do not, with
    /// [`PROXIMAL_WEIGHT`].
    fn follow(&mut self, course: &mut SolveProgress, scale: f64) -> (f64, f64) {
        let (done, least) = (course.done, course.least);
        let mut directions = std::mem::take(&mut self.directions);
        directions.begin(self);
        self.deactivate_converged(course.dozes * scale);
        let (mut sweeps, mut last, mut best) = (0, f64::INFINITY, f64::INFINITY);
        let mut in_vain = 0;
        let last_sweep = loop {
            let (of_own, swept) = self.sweep_to(course);
            let own = swept.scale;
            let (residual, scale) = (of_own * own / own.max(scale), own.max(scale));
            course.effort += 1;
            course.last += u32::from(course.reluctance > 0.0);
            sweeps += 1;
            if residual.is_nan() || residual <= done || course.is_over() {
                break (residual, scale);
            }
            let pause = sweeps % STALL_SWEEPS == 0;
            if course.reluctance > 0.0 || !pause || residual <= STALL_RATIO * last {
                last = if pause { residual } else { last };
                // What a descent has set right may be wrong again after the next sweep.
                if sweeps > 1 {
                    self.deactivate_converged(course.dozes * scale);
                }
                directions.advance(self, swept.square);
                continue;
            }
            in_vain = if residual <= CG_WORTH * best {
                0
            } else {
                in_vain + 1
            };
            if residual <= best {
                best = residual;
                directions.keep(self);
            } else {
                directions.restore(self);
            }
            let left = (MAX_SWEEPS - LAST_SWEEPS).saturating_sub(course.effort);
            if in_vain < CG_TRIES && left > 0 {
                let steps = left.min(CG_STEPS << course.descents);
                course.effort += self.descend(steps, least.max(done * scale), scale);
                course.descents = LONGEST_CG_DOUBLING.min(course.descents + 1);
            } else {
                // The last sweeps: whom they concern is seen anew.
                course.reluctance = PROXIMAL_WEIGHT;
                self.activate_all();
            }
            directions.begin(self);
            (sweeps, last) = (0, f64::INFINITY);
        };
        self.directions = directions;
        last_sweep
    }

    /// A sweep: its residual, that at which the solve is done at most where nothing
    /// changes and no number where something is none, and what it has done.
    fn sweep_to(&mut self, course: &SolveProgress) -> (f64, SweepResult) {
        let swept = self.sweep(course.reluctance);
        let SweepResult { change, scale, .. } = swept;
        let residual = if !(change + scale).is_finite() {
            f64::NAN
        } else if change <= course.least {
            (change / scale).min(course.done) // of round-off alone it says nothing
        } else {
            change / scale
        };
        (residual, swept)
    }
}

/// Where a solve is to come to, and how far it has.
#[derive(Clone, Copy, Debug, Default)]
struct SolveProgress {
    /// Residual to come to, and the change of a relative velocity that is none, m/s.
    done: f64,
    least: f64,
    /// What of its relative velocity a contact changes that falls asleep, over the scale.
    dozes: f64,
    /// Sweeps and steps of descents.
    effort: u32,
    /// How often descents have got longer.
    descents: u32,
    reluctance: f64,
    /// Sweeps with that.
    last: u32,
}

impl SolveProgress {
    /// Whether nothing more is tried.
    fn is_over(&self) -> bool {
        self.last >= LAST_SWEEPS || self.effort >= MAX_SWEEPS
    }
}

/// What a solve has found on the way from sweep to sweep.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchDirections<const D: usize> {
    /// Square of the last sweep's change, J.
    square: f64,
    /// Impulses to come back to, by the places of contacts, N·s.
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

    /// Goes on along the last direction after a sweep, whose change, of this square, stands for
    /// a gradient.
    fn advance<P: SimdBlock>(&mut self, system: &mut ContactSystem<D, P>, square: f64) {
        // A change that grows says that bounds have changed hands: start anew.
        let goes_on = square <= self.square && self.square > 0.0;
        let ratio = if goes_on { square / self.square } else { 0.0 };
        self.square = square;
        system.advance(ratio);
    }
}
