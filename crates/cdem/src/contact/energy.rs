//! Energies of contact, and who receives impulses.

use serde::{Deserialize, Serialize};

use crate::contact::tolerances::UNSOLVED;
use crate::math::profile::{Stage, Stopwatch};
use crate::model::ledger::WorkVelocity;

/// Energies of contact, J, and other sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContactEnergies {
    pub(crate) impact_loss: f64,
    pub(crate) friction_loss: f64,
    pub(crate) fracture_loss: f64,
    pub(crate) touch_count: u64,
    /// Solves that ended with a residual above [`UNSOLVED`], and the worst.
    pub(crate) unsolved_count: u64,
    pub(crate) residual: f64,
    /// Steps of contacts that went farther in them than their target is across.
    pub(crate) overtravel_count: u64,
    /// Deepest penetration at the start of a kick, m.
    pub(crate) penetration: f64,
    /// At which velocity impulses work.
    #[serde(skip)]
    pub(crate) at: WorkVelocity,
    /// Time that contact takes.
    #[serde(skip)]
    pub(crate) watch: Stopwatch,
}

impl ContactEnergies {
    /// Where the energy goes that a slip takes: of a joint, into fracture.
    pub(super) fn slip_loss(&mut self, joint: bool) -> &mut f64 {
        if joint {
            &mut self.fracture_loss
        } else {
            &mut self.friction_loss
        }
    }

    /// What to say of solves that have not got to their residual, and of contacts that
    /// slid too fast.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = String> {
        let unsolved = (self.unsolved_count > 0).then(|| {
            format!(
                "contact impulses: solves that ended with a relative residual above {UNSOLVED:e}: {}, \
                 the worst {:.1e}; contacts press on each other through very different masses, or \
                 wedge: judge forces there with care",
                self.unsolved_count, self.residual
            )
        });
        let hurried = (self.overtravel_count > 0).then(|| {
            format!(
                "contacts that slid farther in a step than the face is across that they were on: {} \
                 times; where such faces bend, contacts may be lost: try a smaller `time.step`",
                self.overtravel_count
            )
        });
        unsolved.into_iter().chain(hurried)
    }

    /// Empty ones of the same kind, for another thread.
    pub(super) fn empty_copy(&self) -> Self {
        Self {
            at: self.at,
            watch: self.watch.beside(),
            ..Self::default()
        }
    }

    /// Adds others, that have been kept since the last lap on any number of threads.
    pub(super) fn add<'a>(&mut self, others: impl Iterator<Item = &'a Self> + Clone) {
        for other in others.clone() {
            self.impact_loss += other.impact_loss;
            self.friction_loss += other.friction_loss;
            self.fracture_loss += other.fracture_loss;
            self.touch_count += other.touch_count;
            self.unsolved_count += other.unsolved_count;
            self.residual = self.residual.max(other.residual);
            self.overtravel_count += other.overtravel_count;
            self.penetration = self.penetration.max(other.penetration);
        }
        self.watch.lap_as(others.map(|other| &other.watch));
    }

    /// Counts the time of work for a solve.
    pub(super) fn time_solution<T>(&mut self, work: impl FnOnce() -> T) -> T {
        self.watch.lap(Stage::Geometry);
        let done = work();
        self.watch.lap(Stage::Solution);
        done
    }

    /// Counts a solve, and its time; it returns its residual.
    pub(super) fn count_solve(&mut self, solve: impl FnOnce() -> f64) {
        let residual = self.time_solution(solve);
        self.unsolved_count += u64::from(residual > UNSOLVED);
        self.residual = self.residual.max(residual);
    }

    /// Books what impulses take whose points had the relative velocity `old` and
    /// have `new`, m/s. Those of closed points take nothing along the normal;
    /// points that an impact elsewhere has parted in a drift meet anew.
    pub(super) fn book_work<const D: usize>(
        &mut self,
        impulse: &[f64; D],
        old: &[f64; D],
        new: &[f64; D],
        impact: bool,
    ) {
        let end = match self.at {
            WorkVelocity::Mean => new,
            WorkVelocity::Before => old,
        };
        let work = |r: usize| 0.5 * impulse[r] * (old[r] + end[r]);
        self.impact_loss -= work(0);
        let sheared: f64 = (1..D).map(work).sum();
        if impact {
            self.impact_loss -= sheared;
        } else {
            self.friction_loss -= sheared;
        }
    }
}

/// Receives each impulse on a node, N·s.
pub(crate) type ImpulseReceiver<'a, const D: usize> = &'a mut dyn FnMut(u32, &[f64; D]);

/// Who receives the impulses of a drift.
pub(crate) struct ImpulseReceivers<'a, const D: usize> {
    pub(crate) of_contacts: ImpulseReceiver<'a, D>,
    /// Those of elements on nodes that are held.
    pub(crate) on_held: ImpulseReceiver<'a, D>,
}
