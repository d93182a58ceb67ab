//! Results folders: permission to write, and the files of a run.
//!
//! A [`Folder`] is claimed before a run, which changes nothing. A [`Recorder`] creates it once the
//! scene is known to be valid, and fills it step by step.

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

/// Returns times, s, and files of the frames in a results folder.
///
/// # Errors
/// If it is not a results folder, or its list of frames cannot be read.
pub(crate) fn frame_files(folder: &Path) -> Result<Vec<(f64, PathBuf)>, ResultsError> {
    if !folder::has_mark(folder) {
        return Err(ResultsError::NoRun {
            path: folder.to_owned(),
        });
    }
    vtk::listed(&folder.join("frames.pvd"))
}

/// Writes a page of text, completely or not at all.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn write_page(path: &Path, page: &str) -> Result<(), ResultsError> {
    file::write_whole(path, |out| out.write_all(page.as_bytes()))
}
