//! Progress on stderr: a bar on a terminal, otherwise a plain line at intervals.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use cdem::significant;
use console::Term;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::quantity::{count, quantity};
use crate::terminal::say;

/// Time between two plain lines.
const LINE_INTERVAL: Duration = Duration::from_secs(10);

/// Time between two updates of the bar.
const BAR_INTERVAL: Duration = Duration::from_millis(100);

/// Current position of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Position {
    /// Number of coarse steps made, and of all.
    pub(crate) step: u64,
    pub(crate) step_count: u64,
    /// Simulated time and its end, s.
    pub(crate) time: f64,
    pub(crate) end: f64,
    pub(crate) element_updates: u64,
}

/// Display of the progress of a run.
pub(crate) struct Progress {
    started: Instant,
    /// Position at that time.
    start: Position,
    shown: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    pub(crate) fn start(start: Position) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let target = ProgressDrawTarget::term(Term::stderr(), 10);
            let style = ProgressStyle::with_template("{bar:24} {percent:>3} %  {wide_msg}")
                .expect("the template is well-formed")
                .progress_chars("━━─");
            ProgressBar::with_draw_target(Some(start.step_count), target).with_style(style)
        });
        let now = Instant::now();
        Self {
            started: now,
            start,
            shown: now,
            bar,
        }
    }

    /// Updates the display if it is due; to be called after each step.
    pub(crate) fn update(&mut self, position: impl FnOnce() -> Position) {
        let interval = match self.bar {
            Some(_) => BAR_INTERVAL,
            None => LINE_INTERVAL,
        };
        if self.shown.elapsed() < interval {
            return;
        }
        self.shown = Instant::now();
        let position = position();
        let text = describe(&position, &self.start, self.started.elapsed());
        match &self.bar {
            Some(bar) => {
                bar.set_position(position.step);
                bar.set_message(text);
            }
            None => {
                let percent = 100 * position.step / position.step_count.max(1);
                say(format_args!("{percent:>3} %  {text}"));
            }
        }
    }

    /// Prints something else, without the bar in the way.
    pub(crate) fn suspend(&self, print: impl FnOnce()) {
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    /// Clears the bar.
    pub(crate) fn end(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}

fn describe(position: &Position, start: &Position, elapsed: Duration) -> String {
    let seconds = elapsed.as_secs_f64();
    let steps = (position.step - start.step) as f64 / seconds;
    let updates = (position.element_updates - start.element_updates) as f64 / seconds;
    let left = (position.step_count - position.step.min(position.step_count)) as f64 / steps;
    let left = match Duration::try_from_secs_f64(left) {
        Ok(left) => format!("{} left", HumanDuration(left)),
        Err(_) => "time left unknown".to_owned(),
    };
    format!(
        "t = {} of {}, {} steps/s, {}, {left}",
        significant(position.time, 3),
        quantity(position.end, "s"),
        count(steps as u64),
        quantity(updates, "updates/s"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_tells_time_speed_and_time_left() {
        let start = Position {
            step: 1000,
            step_count: 5000,
            time: 0.1,
            end: 0.5,
            element_updates: 9_000_000,
        };
        let position = Position {
            step: 2000,
            time: 0.125,
            element_updates: 12_000_000,
            ..start
        };
        assert_eq!(
            describe(&position, &start, Duration::from_secs(2)),
            "t = 0.125 of 500 ms, 500 steps/s, 1.5 Mupdates/s, 6 seconds left"
        );
    }

    #[test]
    fn a_run_without_steps_has_no_estimate_of_its_time() {
        let position = Position {
            step: 0,
            step_count: 4000,
            time: 0.0,
            end: 0.5,
            element_updates: 0,
        };
        let told = describe(&position, &position, Duration::from_secs(2));
        assert!(told.ends_with("time left unknown"));
    }
}
