//! Where the time of a run goes, stage by stage.

#![allow(
    clippy::disallowed_methods,
    reason = "what the clock says here goes to no result"
)]

use std::time::{Duration, Instant};

/// A part of a coarse step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Which pairs may touch.
    Search,
    /// Sub-elements come and go.
    Refinement,
    /// Time levels, and which contacts are solved together.
    Plan,
    /// Forces of elements and loads.
    Forces,
    /// Gaps, directions and times of contacts.
    Geometry,
    /// Impulses of contacts.
    Solution,
    /// Velocities, positions, and the ledger.
    Motion,
    /// Whether the run is sound.
    Checks,
}

impl Stage {
    /// All, in the order of a step.
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

    /// Its name for a user.
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

/// Counts wall-clock time by stage, once it has been started.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stopwatch {
    last: Option<Instant>,
    spent: [Duration; Stage::ALL.len()],
}

impl Stopwatch {
    pub(crate) fn start(&mut self) {
        self.last = Some(Instant::now());
    }

    /// The time since the last call goes to no stage.
    pub(crate) fn skip(&mut self) {
        if self.last.is_some() {
            self.start();
        }
    }

    /// The time since the last call goes to a stage.
    pub(crate) fn lap(&mut self, stage: Stage) {
        if let Some(last) = &mut self.last {
            let now = Instant::now();
            self.spent[stage as usize] += now - *last;
            *last = now;
        }
    }

    /// A watch for another thread, that goes if this one does.
    pub(crate) fn beside(&self) -> Self {
        Self {
            last: self.last.map(|_| Instant::now()),
            ..Self::default()
        }
    }

    /// The time since the last call goes to stages as that of others does, of whatever threads.
    pub(crate) fn lap_as<'a>(&mut self, others: impl Iterator<Item = &'a Self> + Clone) {
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

    /// What a stage has had so far.
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
