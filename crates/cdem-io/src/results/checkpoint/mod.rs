//! Checkpoints, from which a run continues after its process has ended.
//!
//! The folder `checkpoints` in the results folder has scene and mesh of the start, once, and the
//! last two states of the run. Each file is written under another name, synced and renamed, after
//! all results that it refers to. So at least one is complete whenever the process ends.

mod container;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use cdem::AnyMesh;
use cdem::scene::Scene;
use serde::{Deserialize, Serialize};

use super::cadence::Clock;
use super::error::ResultsError;
use super::table::Extent;

/// Name of the folder.
pub(super) const FOLDER: &str = "checkpoints";

/// The list of contacts in the order of their ends. The list in the results is sorted when a
/// process ends; a resumed run appends to this one.
pub(super) const LOG: &str = "contacts.csv";

/// Returns true for the names of files other than states.
pub(super) fn has(name: &str) -> bool {
    [START, LOG].contains(&name)
}

/// Ending of the files.
pub(super) const ENDING: &str = "cdem";

/// The file of scene and mesh.
const START: &str = "start.cdem";

/// Number of states that are kept: the last one, and one more in case the last is lost.
const KEPT: usize = 2;

/// Digits of the step number in a name, so that names are in the order of the steps.
const DIGITS: usize = 12;

/// State of a run at one of its steps.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct State {
    /// Version of the program that wrote it.
    pub(super) version: String,
    pub(super) step: u64,
    pub(super) time: f64,
    /// Extent of the results written so far.
    pub(super) results: Position,
    pub(super) so_far: SoFar,
}

/// Extent of the results of a run.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Position {
    /// Extents of the tables.
    pub(super) history: Extent,
    pub(super) blocks: Extent,
    pub(super) probes: Extent,
    pub(super) contacts: Extent,
    /// Times of frames, s.
    pub(super) frames: Vec<f64>,
    /// Clocks of history rows, block rows and frames.
    pub(super) clocks: [Clock; 3],
}

/// Data of a run that only its driver has, over all processes.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SoFar {
    /// Wall-clock time outside the step loops, s.
    pub setup_seconds: f64,
    /// Wall-clock time of the step loops, s.
    pub wall_seconds: f64,
    /// Warnings from before the first step.
    pub warnings: Vec<String>,
    /// Reason for which the run stopped itself, if it did: then it cannot continue.
    pub stopped: Option<String>,
}

/// Scene and mesh of the start of a run.
pub(super) struct Start {
    pub(super) scene: Scene,
    pub(super) mesh: AnyMesh,
}

/// A checkpoint to write.
pub(super) struct Checkpoint {
    pub(super) start: Option<Start>,
    pub(super) state: State,
    /// Result of [`cdem::Simulation::checkpoint`].
    pub(super) run: Vec<u8>,
    /// Files written since the last checkpoint, which this one refers to.
    pub(super) results: Vec<PathBuf>,
}

/// The checkpoints of a run.
#[derive(Debug)]
pub(super) struct Checkpoints {
    folder: PathBuf,
    has_start: bool,
    is_writing: Arc<AtomicBool>,
}

impl Checkpoints {
    /// Opens the checkpoints of a results folder.
    pub(super) fn new(results: &Path) -> Self {
        let folder = results.join(FOLDER);
        Self {
            has_start: folder.join(START).is_file(),
            folder,
            is_writing: Arc::default(),
        }
    }

    /// True if the next checkpoint must include scene and mesh.
    pub(super) fn wants_start(&self) -> bool {
        !self.has_start
    }

    /// Makes the next checkpoint include scene and mesh again, because the scene has changed.
    pub(super) fn drop_start(&mut self) {
        self.has_start = false;
    }

    /// True if there is a state to continue from.
    pub(super) fn has_state(&self) -> bool {
        states(&self.folder).is_ok_and(|states| !states.is_empty())
    }

    /// True if the last checkpoint has been written.
    pub(super) fn is_ready(&self) -> bool {
        !self.is_writing.load(Ordering::Acquire)
    }

    /// Returns the path of the list of contacts, if there is a checkpoint folder.
    pub(super) fn log(&self) -> Option<PathBuf> {
        self.folder.is_dir().then(|| self.folder.join(LOG))
    }

    /// Returns the job that writes the next checkpoint.
    pub(super) fn begin(
        &mut self,
        checkpoint: Checkpoint,
    ) -> impl FnOnce() -> Result<(), ResultsError> + Send + use<> {
        self.has_start = true;
        let (folder, is_writing) = (self.folder.clone(), Arc::clone(&self.is_writing));
        is_writing.store(true, Ordering::Release);
        move || {
            let written = checkpoint.write(&folder);
            is_writing.store(false, Ordering::Release);
            written
        }
    }
}

impl Checkpoint {
    fn write(self, folder: &Path) -> Result<(), ResultsError> {
        match fs::create_dir(folder) {
            Err(error) if error.kind() != std::io::ErrorKind::AlreadyExists => {
                return Err(ResultsError::write(folder, error));
            }
            _ => (),
        }
        if let Some(start) = &self.start {
            start.write(&folder.join(START))?;
        }
        for path in &self.results {
            let synced = File::open(path).and_then(|file| file.sync_all());
            synced.map_err(|error| ResultsError::write(path, error))?;
        }
        let name = format!("{:0DIGITS$}.{ENDING}", self.state.step);
        container::write(&folder.join(name), &self.state, &[&self.run])?;
        let states = states(folder)?;
        for old in states.iter().rev().skip(KEPT) {
            fs::remove_file(old).map_err(|error| ResultsError::write(old, error))?;
        }
        Ok(())
    }
}

impl Start {
    /// Writes the scene as TOML, with its length in the head, and the mesh.
    fn write(&self, path: &Path) -> Result<(), ResultsError> {
        let scene = crate::scene::write(&self.scene);
        let mesh = postcard::to_stdvec(&self.mesh).expect("memory takes all that has a form");
        container::write(path, &scene.len(), &[scene.as_bytes(), &mesh])
    }

    fn read(path: &Path) -> Result<Self, String> {
        let (length, body) = container::read::<usize>(path)?;
        let (scene, mesh) = body
            .split_at_checked(length)
            .ok_or("ends within its scene")?;
        let scene = std::str::from_utf8(scene).map_err(|_| "has no scene")?;
        let scene = crate::scene::parse(scene, path);
        let mesh = postcard::from_bytes(mesh).map_err(|error| format!("has no mesh: {error}"))?;
        Ok(Self {
            scene: scene.map_err(|error| error.render(false))?.scene,
            mesh,
        })
    }
}

/// Removes all checkpoints of a run that is done.
pub(super) fn remove_all(results: &Path) -> Result<(), ResultsError> {
    let folder = results.join(FOLDER);
    match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(ResultsError::write(&folder, error))
        }
        _ => Ok(()),
    }
}

/// Returns the states in a folder, in the order of their steps.
fn states(folder: &Path) -> Result<Vec<PathBuf>, ResultsError> {
    let read = || {
        let entries = fs::read_dir(folder)?;
        entries.map(|entry| Ok(entry?.path())).collect()
    };
    let paths: std::io::Result<Vec<PathBuf>> = read();
    let mut paths = paths.map_err(|error| ResultsError::read(folder, error))?;
    paths.retain(|path| is_state(path));
    paths.sort();
    Ok(paths)
}

fn is_state(path: &Path) -> bool {
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    path.extension().is_some_and(|ending| ending == ENDING)
        && stem.is_some_and(|stem| stem.len() >= DIGITS && stem.bytes().all(|b| b.is_ascii_digit()))
}

/// The last complete state of a run whose results are still there.
pub(super) struct Last {
    pub(super) start: Start,
    pub(super) state: State,
    pub(super) run: Vec<u8>,
    /// Faults of later states.
    pub(super) passed_over: Vec<String>,
}

/// True if a results folder has states to continue from.
pub(super) fn are_in(results: &Path) -> bool {
    states(&results.join(FOLDER)).is_ok_and(|states| !states.is_empty())
}

impl Last {
    /// Finds the last state in a results folder; `fits` returns the reason if the results do not
    /// match a state.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn find(
        results: &Path,
        fits: impl Fn(&Position) -> Result<(), String>,
    ) -> Result<Self, ResultsError> {
        let folder = results.join(FOLDER);
        let states = if folder.is_dir() {
            states(&folder)?
        } else {
            Vec::new()
        };
        if states.is_empty() {
            return Err(ResultsError::NoCheckpoint {
                path: results.to_owned(),
            });
        }
        let damaged = |path: &Path, why: String| ResultsError::Checkpoint {
            path: path.to_owned(),
            why,
        };
        let start = folder.join(START);
        let start = Start::read(&start).map_err(|why| damaged(&start, why))?;
        let mut passed_over = Vec::new();
        let mut last = None;
        for path in states.iter().rev() {
            let read = container::read::<State>(path);
            match read.and_then(|(state, run)| fits(&state.results).map(|()| (state, run))) {
                Ok((state, run)) => {
                    return Ok(Self {
                        start,
                        state,
                        run,
                        passed_over,
                    });
                }
                Err(why) => {
                    passed_over.push(format!("{} {why}", path.display()));
                    last.get_or_insert((path, why));
                }
            }
        }
        let (path, why) = last.expect("there is one at least");
        Err(damaged(path, why))
    }
}
