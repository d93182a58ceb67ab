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
    pub(super) fn read(path: &Path, source: io::Error) -> Self {
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
            Self::Read { .. } => "check that the folder exists and may be read",
            Self::Write { source, .. } => match source.kind() {
                io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                    "make room on the disk, or write less: fewer frames or fields in [output]"
                }
                io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                    "name a folder that you may write to with -o DIR"
                }
                _ => "check the disk, or name another folder with -o DIR",
            },
        }
    }
}
