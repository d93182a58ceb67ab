//! Shared code of the benchmarks: timing of steps and stages, and result files.

use std::path::{Path, PathBuf};
use std::time::Instant;

use cdem::mesh::ElementKind;
use cdem::scene::Kinematics;
use cdem::{Simulation, Stage};
use serde_json::{Map, Value, json};

use crate::load;

/// Arguments of a benchmark after `--`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// Names.
    pub names: Vec<String>,
    /// Numbers above 0.
    pub numbers: Vec<f64>,
}

impl Asked {
    /// Parses the command line; `known` lists the valid names.
    ///
    /// # Errors
    /// If an argument is neither a number above 0 nor a valid name.
    pub fn of_command(known: &[&str]) -> std::io::Result<Self> {
        Self::of(std::env::args().skip(1), known).map_err(std::io::Error::other)
    }

    fn of(words: impl Iterator<Item = String>, known: &[&str]) -> Result<Self, String> {
        let mut asked = Self::default();
        // Cargo adds `--bench`.
        for word in words.filter(|word| word != "--bench") {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() && number > 0.0 => asked.numbers.push(number),
                _ if known.contains(&&*word) => asked.names.push(word),
                _ if known.is_empty() => return Err(format!("{word}: not a number above 0")),
                _ => {
                    let known = known.join(", ");
                    return Err(format!("{word}: not a number above 0, nor one of: {known}"));
                }
            }
        }
        Ok(asked)
    }

    /// True if `name` was given.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.names.iter().any(|word| word == name)
    }

    /// True if `name` was given, or no name at all.
    #[must_use]
    pub fn wants(&self, name: &str) -> bool {
        self.names.is_empty() || self.has(name)
    }
}

/// Steps that were timed.
#[derive(Clone, Debug)]
pub struct Timed {
    /// Number of steps.
    pub steps: u64,
    /// Number of element updates in these steps.
    pub updates: u64,
    /// Wall time, s.
    pub seconds: f64,
    /// Wall time of each stage, s; 0 if the stages were not timed.
    pub stages: Vec<(Stage, f64)>,
}

impl Timed {
    /// Runs until the end, or until `is_enough(steps, seconds)`, and times the stages. Reading the
    /// clock for the stages takes some tenths of a microsecond per step.
    ///
    /// # Panics
    /// With the message that a user would get, if a step fails.
    pub fn in_stages(simulation: &mut Simulation, is_enough: impl Fn(u64, f64) -> bool) -> Self {
        simulation.time_stages();
        Self::of(simulation, is_enough)
    }

    /// Runs as [`Timed::in_stages`] does, without timing the stages.
    ///
    /// # Panics
    /// With the message that a user would get, if a step fails.
    pub fn of(simulation: &mut Simulation, is_enough: impl Fn(u64, f64) -> bool) -> Self {
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

    /// Returns the element updates per second.
    #[must_use]
    pub fn update_rate(&self) -> f64 {
        self.updates as f64 / self.seconds
    }

    /// Returns the block-steps per second.
    #[must_use]
    pub fn block_rate(&self, blocks: usize) -> f64 {
        (self.steps * blocks as u64) as f64 / self.seconds
    }

    /// Returns the time of a stage, s.
    #[must_use]
    pub fn of_stage(&self, stage: Stage) -> f64 {
        let mut stages = self.stages.iter();
        stages
            .find(|(of, _)| *of == stage)
            .map_or(0.0, |(_, time)| *time)
    }

    /// Returns the fraction of the time of each stage, by name.
    #[must_use]
    pub fn shares(&self) -> Value {
        let shares = self.stages.iter();
        let shares =
            shares.map(|(stage, time)| (stage.name().to_owned(), json!(time / self.seconds)));
        Value::Object(shares.collect::<Map<_, _>>())
    }
}

/// Number of repeated measurements. The shortest counts, because disturbances only add time.
pub const TRIALS: usize = 5;

/// Builds a box of about `cells` cells on one time level, which flies and spins slowly.
///
/// # Panics
/// If its scene cannot be read.
#[must_use]
pub fn free_block(kind: ElementKind, kinematics: Kinematics, cells: f64) -> Simulation {
    let dimension = kind.dimension();
    let mut case = load(if dimension == 2 {
        "free-flight-2d"
    } else {
        "free-flight-3d"
    });
    let along = cells.powf(1.0 / dimension as f64).round() as usize;
    case.divide("block", &vec![along; dimension], kind);
    case.block("block").kinematics = kinematics;
    case.scene.time.end = 1.0;
    case.start()
}

/// Measures the time of the forces, and of a whole step, per element update, s.
///
/// # Panics
/// With the message that a user would get, if a step fails.
pub fn seconds_of_an_update(simulation: &mut Simulation) -> [f64; 2] {
    let forces = |simulation: &Simulation| {
        let times = simulation.stage_times();
        let own = times.iter().find(|(stage, _)| *stage == Stage::Forces);
        own.map_or(0.0, |(_, time)| time.as_secs_f64())
    };
    simulation.time_stages();
    let mut best = [f64::INFINITY; 2];
    for _ in 0..TRIALS {
        let (before, updates) = (forces(simulation), simulation.element_updates());
        let began = Instant::now();
        for _ in 0..10 {
            step(simulation);
        }
        let made = (simulation.element_updates() - updates) as f64;
        let whole = began.elapsed().as_secs_f64() / made;
        best = [
            best[0].min((forces(simulation) - before) / made),
            best[1].min(whole),
        ];
    }
    best
}

/// Advances the run by one step.
///
/// # Panics
/// With the message that a user would get, if the step fails.
pub fn step(simulation: &mut Simulation) {
    if let Err(error) = simulation.step() {
        panic!("{error}");
    }
}

/// Returns the folder of benchmark results, and creates it if it is missing.
///
/// # Errors
/// If the folder cannot be created.
pub fn folder() -> std::io::Result<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/bench");
    std::fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Writes figures to `target/bench/<name>.json`.
///
/// # Errors
/// If the file cannot be written.
pub fn keep(name: &str, figures: &Value) -> std::io::Result<()> {
    std::fs::write(
        folder()?.join(name).with_extension("json"),
        format!("{figures:#}\n"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_known_or_refused() {
        let of = |words: &[&str]| {
            let words = ["--bench"].iter().chain(words).map(|&word| word.to_owned());
            Asked::of(words, &["tet4", "hex8"])
        };
        let asked = of(&["1e6", "tet4"]).expect("both are known");
        assert_eq!((&*asked.numbers, asked.has("tet4")), (&[1e6][..], true));
        assert!(asked.wants("tet4") && !asked.wants("hex8"));
        assert!(of(&[]).expect("nothing is asked").wants("hex8"));
        for wrong in ["tet5", "0", "-1", "nan", "inf"] {
            let why = of(&[wrong]).expect_err("refused");
            assert!(
                why.starts_with(wrong) && why.ends_with("tet4, hex8"),
                "{why}"
            );
        }
    }
}
