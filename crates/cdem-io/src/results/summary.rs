//! `summary.json`: how a run went.

use std::fs;
use std::path::Path;

use cdem::Simulation;
use serde::{Deserialize, Serialize};

use super::checkpoint::SoFar;
use super::error::ResultsError;
use super::file::write_whole;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// It reached its end or its stop condition.
    Done,
    /// It stopped itself.
    Stopped,
    /// The user stopped it.
    Interrupted,
}

/// The contents of `summary.json`, the only file that holds timings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// How the run ended.
    pub status: Status,
    /// Why, for the person who reads it.
    pub reason: String,
    /// Version of the program.
    pub version: String,
    /// Coarse steps taken.
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// The coarse step, s.
    pub step: f64,
    /// Elements per level of time at the end, the coarsest first.
    pub levels: Vec<u64>,
    /// Wall-clock time of the step loop, s.
    pub wall_seconds: f64,
    /// Wall-clock time before the step loop, s.
    pub setup_seconds: f64,
    /// Element updates.
    pub element_updates: u64,
    /// Element updates per second of the step loop.
    pub updates_per_second: f64,
    /// Threads.
    pub threads: usize,
    /// Contact points that began.
    pub contacts_begun: u64,
    /// Largest penetration seen, m.
    pub max_penetration: f64,
    /// Residual of the energy ledger at the end, J.
    pub energy_residual: f64,
    /// What the user should know of this run.
    pub warnings: Vec<String>,
    /// Most memory the process held, bytes; null where the system does not say.
    pub peak_memory_bytes: Option<u64>,
}

/// What only the driver of a run knows of its end.
#[derive(Clone, Debug)]
pub struct Ending {
    /// How it ended.
    pub status: Status,
    /// Why.
    pub reason: String,
    /// What it knew before, all processes together.
    pub so_far: SoFar,
    /// Threads.
    pub threads: usize,
}

impl Summary {
    /// The summary of a run that has ended.
    #[must_use]
    pub fn new(run: &mut Simulation, ending: Ending) -> Self {
        let overview = run.overview();
        let element_updates = run.element_updates();
        let SoFar {
            setup_seconds,
            wall_seconds,
            mut warnings,
            stopped: _,
        } = ending.so_far;
        warnings.extend(run.warnings());
        Self {
            status: ending.status,
            reason: ending.reason,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            steps: run.step_index(),
            time: run.time(),
            step: overview.step,
            levels: overview.levels,
            wall_seconds,
            setup_seconds,
            element_updates,
            updates_per_second: element_updates as f64 / wall_seconds.max(f64::MIN_POSITIVE),
            threads: ending.threads,
            contacts_begun: run.contacts_begun(),
            max_penetration: run.max_penetration(),
            energy_residual: run.history().energy_residual,
            warnings,
            peak_memory_bytes: peak_memory(),
        }
    }

    /// Writes `summary.json`. Numbers that are not finite become null.
    pub(super) fn write(&self, path: &Path) -> Result<(), ResultsError> {
        write_whole(path, |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            out.write_all(b"\n")
        })
    }
}

/// The most memory this process has held, bytes, where the system tells
/// (Linux: the high-water mark of `/proc/self/status`).
fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
