//! Wall-clock time of a run by stage.

#![allow(
    clippy::disallowed_methods,
    reason = "what the clock says here goes to no result"
)]

use std::time::{Duration, Instant};

/// A stage of a coarse step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Broad phase: candidate pairs.
    Search,
    /// Refinement and coarsening of blocks.
    Refinement,
    /// Time levels and islands.
    Plan,
    /// Forces of elements and loads.
    Forces,
    /// Gaps, normals and times of impact.
    Geometry,
    /// Impulses of contacts.
    Solution,
    /// Velocities, positions and the ledger.
    Motion,
    /// Validity checks.
    Checks,
}

impl Stage {
    /// All stages, in the order of a step.
    pub const ALL: [Self; 8] = [
        Self::Search,
        Self::Refinement,
        Self::Plan,
        Self::Forces,
        Self::Geometry,
        Self::Solution,
        Self::Motion,
        Self::Checks,
    ];

    /// Returns the name of the stage for a user.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Search => "search for contacts",
            Self::Refinement => "refinement",
            Self::Plan => "time levels and islands",
            Self::Forces => "forces of elements",
            Self::Geometry => "geometry of contacts",
            Self::Solution => "impulses of contacts",
            Self::Motion => "motion and ledger",
            Self::Checks => "checks",
        }
    }
}

/// Measures wall-clock time by stage, once it has been started.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stopwatch {
    last: Option<Instant>,
    spent: [Duration; Stage::ALL.len()],
}

impl Stopwatch {
    pub(crate) fn start(&mut self) {
        self.last = Some(Instant::now());
    }

    /// Assigns the time since the last call to no stage.
    pub(crate) fn skip(&mut self) {
        if self.last.is_some() {
            self.start();
        }
    }

    /// Assigns the time since the last call to a stage.
    pub(crate) fn lap(&mut self, stage: Stage) {
        if let Some(last) = &mut self.last {
            let now = Instant::now();
            self.spent[stage as usize] += now - *last;
            *last = now;
        }
    }

    /// Returns a stopwatch for another thread. It runs if this one does.
    pub(crate) fn for_thread(&self) -> Self {
        Self {
            last: self.last.map(|_| Instant::now()),
            ..Self::default()
        }
    }

    /// Distributes the time since the last call over the stages in proportion to the times of
    /// `others`, which may come from any threads.
    pub(crate) fn lap_in_proportion<'a>(&mut self, others: impl Iterator<Item = &'a Self> + Clone) {
        let Some(last) = &mut self.last else {
            return;
        };
        let now = Instant::now();
        let since = now - *last;
        *last = now;
        let of = |stage: usize| {
            others
                .clone()
                .map(|other| other.spent[stage])
                .sum::<Duration>()
        };
        let all: Duration = (0..self.spent.len()).map(of).sum();
        if all > Duration::ZERO {
            for stage in 0..self.spent.len() {
                self.spent[stage] += since.mul_f64(of(stage).div_duration_f64(all));
            }
        }
    }

    /// Returns the time spent in a stage so far.
    pub(crate) fn spent(&self, stage: Stage) -> Duration {
        self.spent[stage as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_to_the_stage_that_ends() {
        let mut watch = Stopwatch::default();
        watch.lap(Stage::Search);
        assert_eq!(watch, Stopwatch::default(), "not started");
        watch.start();
        std::thread::sleep(Duration::from_millis(2));
        watch.lap(Stage::Forces);
        std::thread::sleep(Duration::from_millis(2));
        watch.skip();
        watch.lap(Stage::Checks);
        assert!(watch.spent(Stage::Forces) >= Duration::from_millis(2));
        assert!(watch.spent(Stage::Checks) < watch.spent(Stage::Forces));
        assert_eq!(watch.spent(Stage::Search), Duration::ZERO);
    }

    #[test]
    fn stages_stand_in_their_order() {
        for (number, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, number);
        }
    }
}
