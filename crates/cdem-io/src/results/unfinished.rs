//! Results of a run that has not come to its end.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use cdem::AnyMesh;
use cdem::scene::Scene;
use serde::Deserialize;

use super::checkpoint::{self, Last, Position, SoFar};
use super::error::ResultsError;
use super::folder::{BLOCKS, CONTACTS, HISTORY, PROBES, SUMMARY, has_mark};
use super::summary::Status;
use super::table::is_free;

/// What a folder of results holds.
pub enum Found {
    /// A run that is done.
    Done {
        /// How it came to its end.
        reason: String,
    },
    /// One that can go on.
    Unfinished(Box<Unfinished>),
}

/// A run that can go on, as it was at its last checkpoint.
pub struct Unfinished {
    /// Its scene, every default filled in.
    pub scene: Scene,
    /// Its mesh at rest, before refinement.
    pub mesh: AnyMesh,
    /// For [`cdem::Simulation::resumed`].
    pub run: Vec<u8>,
    /// What its driver knew of it.
    pub so_far: SoFar,
    /// Later checkpoints that cannot be used, and why.
    pub passed_over: Vec<String>,
    /// For [`Recorder::reopen`](super::Recorder::reopen).
    pub left_off: LeftOff,
}

/// Where the results of a run have been left off.
pub struct LeftOff {
    pub(super) folder: PathBuf,
    pub(super) position: Position,
}

/// What matters here of `summary.json`.
#[derive(Deserialize)]
struct Ended {
    status: Status,
    reason: String,
}

impl Unfinished {
    /// Finds what there is in a folder; changes nothing but to remove what a run that is done
    /// needs no more.
    ///
    /// # Errors
    /// If it is no folder of results, if a run is writing to it, or if there is no checkpoint
    /// that can be used.
    pub fn find(folder: &Path) -> Result<Found, ResultsError> {
        let path = || folder.to_owned();
        if !has_mark(folder) {
            return Err(ResultsError::NoRun { path: path() });
        }
        if File::open(folder.join(HISTORY)).is_ok_and(|file| !is_free(&file)) {
            return Err(ResultsError::Busy { path: path() });
        }
        let summary = fs::read(folder.join(SUMMARY)).ok();
        let ended = summary.and_then(|text| serde_json::from_slice::<Ended>(&text).ok());
        if let Some(Ended { status, reason }) = ended
            && status == Status::Done
        {
            checkpoint::remove_all(folder)?;
            return Ok(Found::Done { reason });
        }
        let last = Last::find(folder, |position| position.fits(folder))?;
        Ok(Found::Unfinished(Box::new(Self {
            scene: last.start.scene,
            mesh: last.start.mesh,
            run: last.run,
            so_far: last.state.so_far,
            passed_over: last.passed_over,
            left_off: LeftOff {
                folder: path(),
                position: last.state.results,
            },
        })))
    }
}

impl Position {
    /// Whether the results in a folder go that far, or why not.
    fn fits(&self, folder: &Path) -> Result<(), String> {
        let log = Path::new(checkpoint::FOLDER).join(checkpoint::LOG);
        let contacts = if folder.join(&log).exists() {
            log
        } else {
            CONTACTS.into()
        };
        let tables = [
            (HISTORY.into(), self.history),
            (BLOCKS.into(), self.blocks),
            (PROBES.into(), self.probes),
            (contacts, self.contacts),
        ];
        let mut tables = tables.into_iter();
        tables.try_for_each(|(name, extent)| extent.fits(folder, &name))
    }
}
