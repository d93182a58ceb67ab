//! Errors of a results folder.

use std::io;
use std::path::{Path, PathBuf};

use cdem::ResumeError;
use thiserror::Error;

/// A results folder that cannot be used, or a failed read or write.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// The path exists and is not a folder.
    #[error("the results folder {} is a file", path.display())]
    NotFolder {
        /// The path asked for.
        path: PathBuf,
    },
    /// The folder has an earlier run.
    #[error("the results folder {} holds an earlier run", path.display())]
    EarlierRun {
        /// The folder asked for.
        path: PathBuf,
        /// True if it has checkpoints: the run was interrupted, or has stopped itself.
        has_checkpoints: bool,
    },
    /// The folder has an entry that no run wrote.
    #[error("the results folder {} is not empty: {} is not of a run", path.display(), entry.display())]
    Foreign {
        /// The folder asked for.
        path: PathBuf,
        /// The first such entry by name, relative to the folder.
        entry: PathBuf,
    },
    /// The scene to run is in the folder that the run would replace.
    #[error("the results folder {} holds the scene itself", path.display())]
    HoldsScene {
        /// The folder asked for.
        path: PathBuf,
    },
    /// Another run is writing to the folder now.
    #[error("another run is writing to the results folder {}", path.display())]
    Busy {
        /// The folder asked for.
        path: PathBuf,
    },
    /// The folder has no run.
    #[error("{} is not a folder of results", path.display())]
    NoRun {
        /// The folder asked for.
        path: PathBuf,
    },
    /// The run has no checkpoint.
    #[error("the run in {} has no checkpoint to go on from", path.display())]
    NoCheckpoint {
        /// The folder asked for.
        path: PathBuf,
    },
    /// No checkpoint is usable.
    #[error("the checkpoint {} {why}", path.display())]
    Checkpoint {
        /// Its file.
        path: PathBuf,
        /// The fault.
        why: String,
    },
    /// The run had stopped itself at its last checkpoint.
    #[error("the run stopped itself, and cannot go on: {reason}")]
    Stopped {
        /// Reason for which it stopped.
        reason: String,
    },
    /// The state of the last checkpoint does not fit the scene or the program.
    #[error("the last checkpoint cannot be used: {0}")]
    Unusable(#[from] ResumeError),
    /// A frame could not be read.
    #[error("the frame {} {why}", path.display())]
    Frame {
        /// Its file.
        path: PathBuf,
        /// The fault.
        why: String,
    },
    /// The scene of the results could not be read.
    #[error("{why}")]
    Scene {
        /// The error, shown in the text of the scene.
        why: String,
    },
    /// The folder no longer exists.
    #[error("the results folder {} is no longer there", path.display())]
    Gone {
        /// The folder.
        path: PathBuf,
    },
    /// A file or folder could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Message of the system.
        source: io::Error,
    },
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// Message of the system.
        source: io::Error,
    },
}

/// Words of a front end for its means, used in advice to the user.
#[derive(Clone, Copy, Debug)]
pub struct Front {
    /// Means to name another folder, appended to that advice; may be empty.
    pub naming: &'static str,
    /// Means to replace an earlier run.
    pub force: &'static str,
    /// Means to run a scene.
    pub run: &'static str,
    /// Means to continue from a checkpoint.
    pub resume: &'static str,
}

/// Error in the setup of a results folder.
#[derive(Debug)]
pub struct Unprepared {
    /// The error.
    pub error: ResultsError,
    /// True if something had been written or removed before.
    pub touched: bool,
}

impl ResultsError {
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        Self::Read { path, source }
    }

    pub(super) fn write(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        Self::Write { path, source }
    }

    /// Returns advice in the words of a front end.
    #[must_use]
    pub fn help(&self, front: &Front) -> String {
        let Front {
            naming,
            force,
            run,
            resume,
        } = front;
        match self {
            Self::NotFolder { .. } => format!("name another folder{naming}"),
            Self::EarlierRun {
                has_checkpoints: true,
                ..
            } => format!(
                "if that run was interrupted, go on with {resume}; or replace it with {force}, or \
                 name another folder{naming}"
            ),
            Self::EarlierRun { .. } => {
                format!("replace that run with {force}, or name another folder{naming}")
            }
            Self::Foreign { .. } => format!(
                "name a new folder{naming}; {force} replaces earlier runs, never anything else"
            ),
            Self::HoldsScene { .. } => format!("name another folder{naming}, or move the scene"),
            Self::Busy { .. } => format!("wait until it is done, or name another folder{naming}"),
            Self::NoRun { .. } => format!("name the folder that {run} wrote its results to"),
            Self::NoCheckpoint { .. } => format!(
                "it was ended before the first one (`output.checkpoint`, in seconds; 0: none): run \
                 the scene again, with {force} to replace that run"
            ),
            Self::Checkpoint { .. } => format!(
                "go on with the version of cdem that wrote it, if that is another one; else run the \
                 scene again, with {force} to replace that run, and if nothing has happened to the \
                 file, report it as a defect"
            ),
            Self::Stopped { .. } => {
                format!("change the scene and run it again, with {force} to replace this run")
            }
            Self::Unusable(_) => {
                "go on with the version of cdem that wrote it; if this is the one, report a defect"
                    .to_owned()
            }
            Self::Frame { .. } => {
                "run the scene again: the file is not as it was written".to_owned()
            }
            Self::Gone { .. } => format!(
                "it was removed or moved while the run wrote to it: run the scene again, or go on \
                 from the last checkpoint with {resume} and the folder where it is now"
            ),
            Self::Scene { .. } => "the scene of the results is not as it was written".to_owned(),
            Self::Read { .. } => "check that the folder exists and may be read".to_owned(),
            Self::Write { source, .. } => help_with_writing(source.kind(), naming),
        }
    }
}

/// Returns advice on a file that cannot be written.
fn help_with_writing(kind: io::ErrorKind, naming: &str) -> String {
    match kind {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "make room on the disk, or write less: fewer `output.frames` or `output.fields`"
                .to_owned()
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            format!("name a folder that you may write to{naming}")
        }
        _ => format!("check the disk, or name another folder{naming}"),
    }
}
