//! Results of a run that is not done.

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

/// The run in a results folder.
pub enum Found {
    /// A run that is done.
    Done {
        /// Reason of its end.
        reason: String,
    },
    /// A run that can continue.
    Unfinished(Box<Unfinished>),
}

/// A run that can continue, in the state of its last checkpoint.
pub struct Unfinished {
    /// Its scene, with every default filled in.
    pub scene: Scene,
    /// Its mesh at rest, before refinement.
    pub mesh: AnyMesh,
    /// The state, for [`cdem::Simulation::resumed`].
    pub run: Vec<u8>,
    /// Data of its driver.
    pub so_far: SoFar,
    /// Later checkpoints that cannot be used, with the reasons.
    pub passed_over: Vec<String>,
    /// Extent of the results, for [`Recorder::reopen`](super::Recorder::reopen).
    pub left_off: LeftOff,
}

/// Folder and extent of the results at the last checkpoint.
pub struct LeftOff {
    pub(super) folder: PathBuf,
    pub(super) position: Position,
}

/// The keys of `summary.json` that are used.
#[derive(Deserialize)]
struct Ended {
    status: Status,
    reason: String,
}

impl Unfinished {
    /// Finds the run in a folder. Changes nothing, except that it removes the checkpoints of a run
    /// that is done.
    ///
    /// # Errors
    /// If it is not a results folder, if a run is writing to it, or if there is no usable
    /// checkpoint.
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
    /// Checks that the results in a folder match, or returns the fault.
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
