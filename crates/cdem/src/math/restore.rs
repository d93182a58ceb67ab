//! Errors of a checkpoint that does not fit its run.

use thiserror::Error;

/// Why a run cannot go on from a checkpoint.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// It holds something else than the state of a run of this version.
    #[error("it does not hold the state of a run: {0}")]
    Unreadable(postcard::Error),
    /// It is not of a run of this scene and mesh.
    #[error("it is not of a run of this scene: {0}")]
    Misfit(&'static str),
}

/// Says what of a checkpoint does not fit, if it is not `fits`.
pub(crate) fn require(fits: bool, what: &'static str) -> Result<(), ResumeError> {
    fits.then_some(()).ok_or(ResumeError::Misfit(what))
}
