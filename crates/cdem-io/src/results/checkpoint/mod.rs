//! Checkpoints: what a run needs to go on after its process has ended.
//!
//! A folder `checkpoints` in that of the results holds the start of the run, its scene and its
//! mesh, once, and the last two states of it. Each file is written beside its place, synced and
//! renamed, after all results that it counts on: whenever the process ends, one is whole.

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

/// The list of contacts in the order of their ends: that of the results is sorted when a
/// process ends, and goes on from this one.
pub(super) const LOG: &str = "contacts.csv";

/// Whether it has a file of this name besides states.
pub(super) fn has(name: &str) -> bool {
    [START, LOG].contains(&name)
}

/// Ending of its files.
pub(super) const ENDING: &str = "cdem";

/// The file of scene and mesh.
const START: &str = "start.cdem";

/// States that are kept: the last, and one more, should that be lost.
const KEPT: usize = 2;

/// Digits of the number of a step in a name, so that names are in the order of the steps.
const DIGITS: usize = 12;

/// A run as it is at one of its steps.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct State {
    /// The program that wrote it.
    pub(super) version: String,
    pub(super) step: u64,
    pub(super) time: f64,
    /// How far the results have been written.
    pub(super) results: Position,
    pub(super) so_far: SoFar,
}

/// How far results have been written.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Position {
    /// Of tables.
    pub(super) history: Extent,
    pub(super) blocks: Extent,
    pub(super) probes: Extent,
    pub(super) contacts: Extent,
    /// Times of frames, s.
    pub(super) frames: Vec<f64>,
    /// When rows of history and blocks, and frames, are due next.
    pub(super) clocks: [Clock; 3],
}

/// What only the driver of a run knows of it, all processes together.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SoFar {
    /// Wall-clock time before step loops, s.
    pub setup_seconds: f64,
    /// Wall-clock time of step loops, s.
    pub wall_seconds: f64,
    /// What was to be said before the first step.
    pub warnings: Vec<String>,
    /// Why it has stopped itself, if it has: it cannot go on.
    pub stopped: Option<String>,
}

/// What a run has begun with.
pub(super) struct Start {
    pub(super) scene: Scene,
    pub(super) mesh: AnyMesh,
}

/// A checkpoint to be written.
pub(super) struct Checkpoint {
    pub(super) start: Option<Start>,
    pub(super) state: State,
    /// What [`cdem::Simulation::checkpoint`] gives.
    pub(super) run: Vec<u8>,
    /// Files written since the last one, which this counts on.
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
    /// In a folder of results.
    pub(super) fn new(results: &Path) -> Self {
        let folder = results.join(FOLDER);
        Self {
            has_start: folder.join(START).is_file(),
            folder,
            is_writing: Arc::default(),
        }
    }

    /// Whether the next is to bring scene and mesh.
    pub(super) fn wants_start(&self) -> bool {
        !self.has_start
    }

    /// Has the next bring scene and mesh again, since the scene has changed.
    pub(super) fn drop_start(&mut self) {
        self.has_start = false;
    }

    /// Whether there is any state to go on from.
    pub(super) fn has_state(&self) -> bool {
        states(&self.folder).is_ok_and(|states| !states.is_empty())
    }

    /// Whether the last one has been written.
    pub(super) fn is_ready(&self) -> bool {
        !self.is_writing.load(Ordering::Acquire)
    }

    /// Where the list of contacts is to be kept, if there is any checkpoint to go on from.
    pub(super) fn log(&self) -> Option<PathBuf> {
        self.folder.is_dir().then(|| self.folder.join(LOG))
    }

    /// What is to be done to write the next.
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
    /// The scene as TOML, its length in the head, and the mesh.
    fn write(&self, path: &Path) -> Result<(), ResultsError> {
        let scene = crate::scene::write(&self.scene);
        let mesh = postcard::to_stdvec(&self.mesh).expect("memory takes all that has a form");
        container::write(path, &scene.len(), &[scene.as_bytes(), &mesh])
    }

    fn read(path: &Path) -> Result<Self, String> {
        let (length, body) = container::read::<usize>(path)?;
        let (scene, mesh) = body.split_at_checked(length).ok_or("ends in its scene")?;
        let scene = std::str::from_utf8(scene).map_err(|_| "holds no scene")?;
        let scene = crate::scene::parse(scene, path);
        let mesh = postcard::from_bytes(mesh).map_err(|error| format!("holds no mesh: {error}"))?;
        Ok(Self {
            scene: scene.map_err(|error| error.render(false))?.scene,
            mesh,
        })
    }
}

/// Removes all checkpoints of a run, which is done.
pub(super) fn remove_all(results: &Path) -> Result<(), ResultsError> {
    let folder = results.join(FOLDER);
    match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(ResultsError::write(&folder, error))
        }
        _ => Ok(()),
    }
}

/// States in a folder, in the order of their steps.
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

/// The last state of a run that is whole and that its results go up to.
pub(super) struct Last {
    pub(super) start: Start,
    pub(super) state: State,
    pub(super) run: Vec<u8>,
    /// What was wrong with later ones.
    pub(super) passed_over: Vec<String>,
}

/// Whether a folder of results holds states to go on from.
pub(super) fn are_in(results: &Path) -> bool {
    states(&results.join(FOLDER)).is_ok_and(|states| !states.is_empty())
}

impl Last {
    /// Of the run in a folder of results; `fits` says why results do not go up to a state.
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
