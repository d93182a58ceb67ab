//! Results folders: who may write where, and the files of a run.
//!
//! A [`Folder`] is claimed before a run, which touches nothing; a [`Recorder`]
//! makes it when the scene is known to be good and fills it step by step.

mod cadence;
mod checkpoint;
mod error;
mod file;
mod folder;
mod recorder;
mod rows;
mod summary;
mod table;
mod unfinished;
mod vtk;

pub use checkpoint::SoFar;
pub use error::{ResultsError, Unprepared};
pub use folder::Folder;
pub use recorder::{Observed, Recorder};
pub use summary::{Ending, Status, Summary};
pub use unfinished::{Found, Unfinished};
pub use vtk::write_frame;
