//! `summary.json`: the outcome of a run.

use std::fs;
use std::path::Path;

use cdem::Simulation;
use serde::{Deserialize, Serialize};

use super::checkpoint::SoFar;
use super::error::ResultsError;
use super::file::write_whole;

/// Status at the end of a run.
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

/// Content of `summary.json`, the only file with timings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Status at the end.
    pub status: Status,
    /// Reason, for the user.
    pub reason: String,
    /// Version of the program.
    pub version: String,
    /// Number of coarse steps made.
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// The coarse step, s.
    pub step: f64,
    /// Number of elements of each time level at the end, coarsest first.
    pub levels: Vec<u64>,
    /// Wall-clock time of the step loop, s.
    pub wall_seconds: f64,
    /// Wall-clock time before the step loop, s.
    pub setup_seconds: f64,
    /// Number of element updates.
    pub element_updates: u64,
    /// Element updates per second of the step loop.
    pub updates_per_second: f64,
    /// Number of threads.
    pub threads: usize,
    /// Number of contact points that began.
    pub contacts_begun: u64,
    /// Largest penetration, m.
    pub max_penetration: f64,
    /// Energy residual at the end, J.
    pub energy_residual: f64,
    /// Warnings of this run.
    pub warnings: Vec<String>,
    /// Peak memory of the process, bytes; null if the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

/// Data of the end of a run that only its driver has.
#[derive(Clone, Debug)]
pub struct Ending {
    /// Status.
    pub status: Status,
    /// Reason.
    pub reason: String,
    /// Its earlier data, over all processes.
    pub so_far: SoFar,
    /// Number of threads.
    pub threads: usize,
}

impl Summary {
    /// Creates the summary of a run that has ended.
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

/// Returns the peak memory of this process, bytes, if the system tells (Linux: the high-water mark
/// of `/proc/self/status`).
fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
