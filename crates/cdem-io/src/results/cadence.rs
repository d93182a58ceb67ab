//! Clock of rows and frames.

use cdem::scene::Cadence;
use serde::{Deserialize, Serialize};

/// Decides at which steps an output is due: the first one at or after each nominal time. Nominal
/// times are the multiples of an interval.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Clock {
    /// Time between two nominal times, s; `None`: never due.
    interval: Option<f64>,
    /// Number of the last nominal time reached.
    passed: Option<f64>,
    /// Time of the last output, s.
    written: Option<f64>,
}

/// Fraction of an interval by which a step may miss a nominal time and still count as at it: more
/// than the round-off of 1e6 intervals, less than a step.
const ROUND_OFF: f64 = 1e-9;

impl Clock {
    /// Creates the clock of a run that ends at `end`, s. `Count(0)` is never due.
    pub(super) fn new(cadence: Cadence, end: f64) -> Self {
        let interval = match cadence {
            Cadence::Count(0) => None,
            Cadence::Count(count) => Some(end / count as f64),
            Cadence::Interval(interval) => Some(interval),
        };
        Self {
            interval,
            passed: None,
            written: None,
        }
    }

    /// True if an output is due at the step that ends at `time`; to be called once a step.
    pub(super) fn due(&mut self, time: f64) -> bool {
        let number = self.next(time);
        if number.is_some() {
            self.passed = number;
            self.written = Some(time);
        }
        number.is_some()
    }

    /// True if an output would be due; changes nothing.
    pub(super) fn is_due(&self, time: f64) -> bool {
        self.next(time).is_some()
    }

    /// Returns the number of the nominal time that a step to `time` is the first to reach.
    fn next(&self, time: f64) -> Option<f64> {
        let number = (time / self.interval? + ROUND_OFF).floor();
        self.passed
            .is_none_or(|passed| number > passed)
            .then_some(number)
    }

    /// True if the run that ends at `time` still needs its last output.
    pub(super) fn due_at_end(&mut self, time: f64) -> bool {
        self.interval.is_some() && self.written.replace(time) != Some(time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn due_steps(cadence: Cadence, end: f64, steps: u32) -> Vec<u32> {
        let mut clock = Clock::new(cadence, end);
        (0..=steps)
            .filter(|&step| {
                let time = f64::from(step) * (end / f64::from(steps));
                let foreseen = clock.is_due(time);
                assert_eq!(clock.due(time), foreseen);
                foreseen
            })
            .collect()
    }

    #[test]
    fn rows_come_at_or_after_their_time() {
        // 10 steps, nominal times every 2.5 steps.
        assert_eq!(due_steps(Cadence::Count(4), 0.3, 10), [0, 3, 5, 8, 10]);
    }

    #[test]
    fn an_interval_that_misses_the_end_gets_its_last_row() {
        let mut clock = Clock::new(Cadence::Interval(0.4), 1.0);
        let due: Vec<bool> = [0.0, 0.5, 1.0].map(|time| clock.due(time)).into();
        assert_eq!(due, [true, true, true]);
        let mut clock = Clock::new(Cadence::Interval(0.6), 1.0);
        let due: Vec<bool> = [0.0, 0.5, 1.0].map(|time| clock.due(time)).into();
        assert_eq!(due, [true, false, true]);
        assert!(!clock.due_at_end(1.0));
        assert!(clock.due_at_end(1.1));
    }

    #[test]
    fn zero_means_never() {
        let mut clock = Clock::new(Cadence::Count(0), 1.0);
        assert!(!clock.due(0.0));
        assert!(!clock.due_at_end(1.0));
    }

    proptest! {
        #[test]
        fn a_count_gives_one_row_more_unless_steps_are_fewer(
            count in 1_usize..3000,
            steps in 1_u32..3000,
            end in 1e-9_f64..1e9,
        ) {
            let due = due_steps(Cadence::Count(count), end, steps);
            prop_assert_eq!(due.len(), count.min(steps as usize) + 1);
            prop_assert_eq!((due[0], due[due.len() - 1]), (0, steps));
        }
    }
}
