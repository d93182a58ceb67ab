//! Errors of a checkpoint that does not fit its run.

use thiserror::Error;

/// The reason why a run cannot be resumed from a checkpoint.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// The checkpoint does not contain the state of a run of this version.
    #[error("it does not contain the state of a run: {0}")]
    Unreadable(postcard::Error),
    /// The checkpoint belongs to another scene or mesh.
    #[error("it is from a run of another scene or mesh; the difference is in {0}")]
    Misfit(&'static str),
}

/// Returns [`ResumeError::Misfit`] with `what` unless `fits`.
pub(crate) fn require(fits: bool, what: &'static str) -> Result<(), ResumeError> {
    fits.then_some(()).ok_or(ResumeError::Misfit(what))
}
