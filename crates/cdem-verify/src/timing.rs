//! What benchmarks share: steps by the clock and by the stage, and figures kept as files.

#![allow(
    clippy::disallowed_methods,
    reason = "a benchmark tells what the clock says"
)]

use std::path::{Path, PathBuf};
use std::time::Instant;

use cdem::{Simulation, Stage};
use serde_json::{Map, Value, json};

/// Steps that were timed.
#[derive(Clone, Debug)]
pub struct Timed {
    /// How many.
    pub steps: u64,
    /// Updates of elements in them.
    pub updates: u64,
    /// What they took, s.
    pub seconds: f64,
    /// What each stage took of that, s.
    pub stages: Vec<(Stage, f64)>,
}

impl Timed {
    /// Steps of a run until it has ended, or `is_enough` says so of the steps and seconds so far.
    ///
    /// # Panics
    /// With the message a user would get, if a step fails.
    pub fn of(simulation: &mut Simulation, is_enough: impl Fn(u64, f64) -> bool) -> Self {
        simulation.time_stages();
        let stages = simulation.stage_times();
        let (first, updates) = (simulation.step_index(), simulation.element_updates());
        let (began, mut steps, mut seconds) = (Instant::now(), 0, 0.0);
        while !simulation.finished() && !is_enough(steps, seconds) {
            step(simulation);
            steps = simulation.step_index() - first;
            seconds = began.elapsed().as_secs_f64();
        }
        let spent = simulation.stage_times().into_iter().zip(stages);
        Self {
            steps,
            updates: simulation.element_updates() - updates,
            seconds,
            stages: spent
                .map(|((stage, after), (_, before))| (stage, (after - before).as_secs_f64()))
                .collect(),
        }
    }

    /// Updates of elements a second.
    #[must_use]
    pub fn update_rate(&self) -> f64 {
        self.updates as f64 / self.seconds
    }

    /// Steps of so many blocks a second.
    #[must_use]
    pub fn block_rate(&self, blocks: usize) -> f64 {
        (self.steps * blocks as u64) as f64 / self.seconds
    }

    /// Shares of the stages, by their names.
    #[must_use]
    pub fn shares(&self) -> Value {
        let shares = self.stages.iter();
        let shares =
            shares.map(|(stage, time)| (stage.name().to_owned(), json!(time / self.seconds)));
        Value::Object(shares.collect::<Map<_, _>>())
    }
}

/// One step of a run.
///
/// # Panics
/// With the message a user would get, if it fails.
pub fn step(simulation: &mut Simulation) {
    if let Err(error) = simulation.step() {
        panic!("{error}");
    }
}

/// Where benchmarks keep their files; made where it is missing.
///
/// # Errors
/// If the disk refuses.
pub fn folder() -> std::io::Result<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/bench");
    std::fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Keeps figures as `target/bench/<name>.json`.
///
/// # Errors
/// If the disk refuses.
pub fn keep(name: &str, figures: &Value) -> std::io::Result<()> {
    std::fs::write(
        folder()?.join(name).with_extension("json"),
        format!("{figures:#}\n"),
    )
}
