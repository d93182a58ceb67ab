//! What can go wrong with a results folder.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A results folder that cannot be used, or a disk that refuses.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// The path exists and is no folder.
    #[error("the results folder {} is a file", path.display())]
    NotFolder {
        /// The path asked for.
        path: PathBuf,
    },
    /// The folder holds an earlier run.
    #[error("the results folder {} holds an earlier run", path.display())]
    EarlierRun {
        /// The folder asked for.
        path: PathBuf,
    },
    /// The folder holds something that no run wrote.
    #[error("the results folder {} is not empty: {} is not of a run", path.display(), entry.display())]
    Foreign {
        /// The folder asked for.
        path: PathBuf,
        /// The first such entry by name, relative to the folder.
        entry: PathBuf,
    },
    /// The scene to run lies in the folder that a run would replace.
    #[error("the results folder {} holds the scene itself", path.display())]
    HoldsScene {
        /// The folder asked for.
        path: PathBuf,
    },
    /// A run is writing to the folder now.
    #[error("another run is writing to the results folder {}", path.display())]
    Busy {
        /// The folder asked for.
        path: PathBuf,
    },
    /// The folder holds no run to go on with.
    #[error("{} is not a folder of results", path.display())]
    NoRun {
        /// The folder asked for.
        path: PathBuf,
    },
    /// Its run has left no checkpoint.
    #[error("the run in {} has no checkpoint to go on from", path.display())]
    NoCheckpoint {
        /// The folder asked for.
        path: PathBuf,
    },
    /// No checkpoint can be used.
    #[error("the checkpoint {} {why}", path.display())]
    Checkpoint {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A frame could not be read.
    #[error("the frame {} {why}", path.display())]
    Frame {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The scene of the results could not be read.
    #[error("{why}")]
    Scene {
        /// What is wrong with it, shown in its text.
        why: String,
    },
    /// The folder is gone.
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
        /// What the system said.
        source: io::Error,
    },
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Why a folder could not be set up for a run.
#[derive(Debug)]
pub struct Unprepared {
    /// What went wrong.
    pub error: ResultsError,
    /// Whether anything had been written or removed before.
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

    /// What to try.
    #[must_use]
    pub fn help(&self) -> &'static str {
        match self {
            Self::NotFolder { .. } => "name another folder with -o DIR",
            Self::EarlierRun { .. } => {
                "replace that run with --force, or name another folder with -o DIR"
            }
            Self::Foreign { .. } => {
                "name a new folder with -o DIR; --force replaces earlier runs, never anything else"
            }
            Self::HoldsScene { .. } => "name another folder with -o DIR, or move the scene",
            Self::Busy { .. } => "wait until it is done, or name another folder with -o DIR",
            Self::NoRun { .. } => "name the folder that `cdem run` wrote its results to",
            Self::NoCheckpoint { .. } => {
                "it was ended before the first one ([output] checkpoint, in seconds; 0: none): run \
                 the scene again, with --force to replace that run"
            }
            Self::Checkpoint { .. } => {
                "go on with the version of cdem that wrote it, if that is another one; else run the \
                 scene again, with --force to replace that run, and if nothing has happened to the \
                 file, report it as a defect"
            }
            Self::Frame { .. } => "run the scene again: the file is not as it was written",
            Self::Gone { .. } => {
                "it was removed or moved while the run wrote to it: run the scene again, or go on \
                 from the last checkpoint with `cdem resume` and the folder where it is now"
            }
            Self::Scene { .. } => "the scene of the results is not as it was written",
            Self::Read { .. } => "check that the folder exists and may be read",
            Self::Write { source, .. } => match source.kind() {
                io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                    "make room on the disk, or write less: fewer frames or fields in [output]"
                }
                io::ErrorKind::NotFound => {
                    "name another folder with -o DIR; if this one was there, it was removed or \
                     moved while the run wrote to it"
                }
                io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                    "name a folder that you may write to with -o DIR"
                }
                _ => "check the disk, or name another folder with -o DIR",
            },
        }
    }
}
