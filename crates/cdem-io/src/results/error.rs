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
    #[error("the results folder {} contains an earlier run", path.display())]
    EarlierRun {
        /// The folder asked for.
        path: PathBuf,
        /// True if it has checkpoints: the run was interrupted, or has stopped itself.
        has_checkpoints: bool,
    },
    /// The folder has an entry that no run wrote.
    #[error(
        "the results folder {} is not empty: {} is no file of a run",
        path.display(), entry.display()
    )]
    Foreign {
        /// The folder asked for.
        path: PathBuf,
        /// The first such entry by name, relative to the folder.
        entry: PathBuf,
    },
    /// The scene to run is in the folder that the run would replace.
    #[error("the results folder {} contains the scene itself", path.display())]
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
    #[error("{} is no results folder", path.display())]
    NoRun {
        /// The folder asked for.
        path: PathBuf,
    },
    /// The run has no checkpoint.
    #[error("the run in {} has no checkpoint to resume from", path.display())]
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
    #[error("the run stopped itself and cannot be resumed: {reason}")]
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
    #[error("the results folder {} no longer exists", path.display())]
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
                "resume that run with {resume} if it was interrupted, replace it with {force}, or \
                 name another folder{naming}"
            ),
            Self::EarlierRun { .. } => {
                format!("replace that run with {force}, or name another folder{naming}")
            }
            Self::Foreign { .. } => {
                format!("name a new folder{naming}; {force} replaces only earlier runs")
            }
            Self::HoldsScene { .. } => format!("name another folder{naming}, or move the scene"),
            Self::Busy { .. } => format!("wait until it is done, or name another folder{naming}"),
            Self::NoRun { .. } => format!("name a folder with results of {run}"),
            Self::NoCheckpoint { .. } => format!(
                "it ended before the first checkpoint, or has `output.checkpoint` = 0: run the \
                 scene again, with {force} to replace that run"
            ),
            Self::Checkpoint { .. } => format!(
                "if another version of cdem wrote it, resume with that version; else run the scene \
                 again, with {force} to replace that run; if nothing has changed the file, \
                 report a defect"
            ),
            Self::Stopped { .. } => {
                format!("change the scene and run it again, with {force} to replace this run")
            }
            Self::Unusable(_) => {
                "resume with the version of cdem that wrote it; if it is this one, report a defect"
                    .to_owned()
            }
            Self::Frame { .. } => {
                "the file has changed since it was written: run the scene again".to_owned()
            }
            Self::Gone { .. } => format!(
                "it was removed or moved during the run: run the scene again, or resume from the \
                 last checkpoint with {resume} and the new path of the folder"
            ),
            Self::Scene { .. } => {
                "the scene of the results has changed since it was written".to_owned()
            }
            Self::Read { .. } => "check that the folder exists and that you may read it".to_owned(),
            Self::Write { source, .. } => help_with_writing(source.kind(), naming),
        }
    }
}

/// Returns advice on a file that cannot be written.
fn help_with_writing(kind: io::ErrorKind, naming: &str) -> String {
    match kind {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free space on the disk, or write fewer `output.frames` or `output.fields`".to_owned()
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            format!("name a folder that you may write to{naming}")
        }
        _ => format!("check the disk, or name another folder{naming}"),
    }
}
