//! Results folders: who may write where, and the files of a run.
//!
//! A [`Folder`] is claimed before a run, which touches nothing; a [`Recorder`]
//! makes it when the scene is known to be good and fills it step by step.

mod background;
mod cadence;
mod checkpoint;
mod error;
mod file;
mod folder;
mod recorder;
mod recording;
mod rows;
mod summary;
mod table;
mod unfinished;
mod vtk;

use std::path::{Path, PathBuf};

pub use checkpoint::SoFar;
pub use error::{Front, ResultsError, Unprepared};
pub use folder::Folder;
pub(crate) use folder::{BLOCKS, CONTACTS, HISTORY, REPORT, SCENE, SUMMARY};
pub use recorder::{Observed, Recorder};
pub use recording::{End, Recording};
pub use summary::{Ending, Status, Summary};
pub use unfinished::{Found, LeftOff, Unfinished};
pub use vtk::write_frame;
pub(crate) use vtk::{SavedFrame, read_frame};

/// Times, s, and files of the frames of a run in a folder of results.
///
/// # Errors
/// If it is none, or its list of frames cannot be read.
pub(crate) fn frame_files(folder: &Path) -> Result<Vec<(f64, PathBuf)>, ResultsError> {
    if !folder::has_mark(folder) {
        return Err(ResultsError::NoRun {
            path: folder.to_owned(),
        });
    }
    vtk::listed(&folder.join("frames.pvd"))
}

/// Writes a page of text, whole or not at all.
///
/// # Errors
/// If the disk refuses.
pub(crate) fn write_page(path: &Path, page: &str) -> Result<(), ResultsError> {
    file::write_whole(path, |out| out.write_all(page.as_bytes()))
}
