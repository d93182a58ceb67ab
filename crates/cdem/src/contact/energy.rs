//! Energies of contact, and impulses of a drift.

use serde::{Deserialize, Serialize};

use crate::contact::penetration::Penetration;
use crate::contact::tolerances::UNSOLVED;
use crate::math::profile::{Stage, Stopwatch};
use crate::model::ledger::WorkVelocity;

/// Losses, J, and counts of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContactEnergies {
    pub(crate) impact_loss: f64,
    pub(crate) friction_loss: f64,
    pub(crate) fracture_loss: f64,
    /// The number of contacts that have begun.
    pub(crate) touch_count: u64,
    /// The number of solves that ended with a residual above [`UNSOLVED`], and the largest
    /// residual of all solves.
    pub(crate) unsolved_count: u64,
    pub(crate) residual: f64,
    /// The number of times that a contact slid farther in a substep than the size of its
    /// target. On the way it stayed in a plane that the surface may have left.
    pub(crate) overtravel_count: u64,
    /// Deepest penetration at the start of a kick.
    pub(crate) penetration: Penetration,
    /// Velocity at which the work of impulses is taken.
    #[serde(skip)]
    pub(crate) at: WorkVelocity,
    /// Time that contact takes.
    #[serde(skip)]
    pub(crate) watch: Stopwatch,
}

impl ContactEnergies {
    /// Returns the loss that the energy of a slip belongs to: that of a joint is fracture.
    pub(super) fn slip_loss(&mut self, joint: bool) -> &mut f64 {
        if joint {
            &mut self.fracture_loss
        } else {
            &mut self.friction_loss
        }
    }

    /// Returns warnings on solves that missed their residual, and on contacts that slid too
    /// fast.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = String> {
        let unsolved = (self.unsolved_count > 0).then(|| {
            format!(
                "number of solves for contact impulses that ended with a residual above \
                 {UNSOLVED:e}: {}; largest residual: {:.1e}; the contacts there join very \
                 different masses, or a block is wedged: their forces may be inaccurate",
                self.unsolved_count, self.residual
            )
        });
        let hurried = (self.overtravel_count > 0).then(|| {
            format!(
                "number of contacts that slid farther in one step than the width of their face: \
                 {}; at bends of the surface such contacts may be lost: try a smaller `time.step`",
                self.overtravel_count
            )
        });
        unsolved.into_iter().chain(hurried)
    }

    /// Returns an empty account of the same kind, for another thread.
    pub(super) fn empty_copy(&self) -> Self {
        Self {
            at: self.at,
            watch: self.watch.for_thread(),
            ..Self::default()
        }
    }

    /// Adds accounts that were kept since the last lap, on any number of threads.
    pub(super) fn add<'a>(&mut self, others: impl Iterator<Item = &'a Self> + Clone) {
        for other in others.clone() {
            self.impact_loss += other.impact_loss;
            self.friction_loss += other.friction_loss;
            self.fracture_loss += other.fracture_loss;
            self.touch_count += other.touch_count;
            self.unsolved_count += other.unsolved_count;
            self.residual = self.residual.max(other.residual);
            self.overtravel_count += other.overtravel_count;
            self.penetration.include(other.penetration);
        }
        self.watch
            .lap_in_proportion(others.map(|other| &other.watch));
    }

    /// Measures the time of work for a solve.
    pub(super) fn time_solution<T>(&mut self, work: impl FnOnce() -> T) -> T {
        self.watch.lap(Stage::Geometry);
        let done = work();
        self.watch.lap(Stage::Solution);
        done
    }

    /// Counts a solve, its time and the residual that it returns.
    pub(super) fn count_solve(&mut self, solve: impl FnOnce() -> f64) {
        let residual = self.time_solution(solve);
        self.unsolved_count += u64::from(residual > UNSOLVED);
        self.residual = self.residual.max(residual);
    }

    /// Books the work of an impulse at a contact whose relative velocity changed from `old` to
    /// `new`, m/s. The work along the normal is an impact loss. It vanishes for a contact that
    /// stays closed. An impact elsewhere may open a contact in a drift; when that contact closes
    /// again, it loses energy. The work of shear is an impact loss if `impact`, otherwise a
    /// friction loss. Returns the loss along the normal, J.
    pub(super) fn book_work<const D: usize>(
        &mut self,
        impulse: &[f64; D],
        [old, new]: [&[f64; D]; 2],
        impact: bool,
    ) -> f64 {
        let end = match self.at {
            WorkVelocity::Mean => new,
            WorkVelocity::Before => old,
        };
        let work = |r: usize| 0.5 * impulse[r] * (old[r] + end[r]);
        let normal_loss = -work(0);
        self.impact_loss += normal_loss;
        let sheared: f64 = (1..D).map(work).sum();
        if impact {
            self.impact_loss -= sheared;
        } else {
            self.friction_loss -= sheared;
        }
        normal_loss
    }
}

/// Impulses of a drift on nodes, N·s.
#[derive(Debug, Default)]
pub(crate) struct DriftImpulses<const D: usize> {
    pub(crate) of_contacts: Vec<(u32, [f64; D])>,
    /// Impulses of elements on nodes with prescribed components.
    pub(crate) on_prescribed: Vec<(u32, [f64; D])>,
}
