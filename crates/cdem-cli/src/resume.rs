//! `cdem resume`: not there yet.

use std::path::Path;

use crate::failure::{Failure, Message};

pub(crate) fn resume(results: &Path) -> Failure {
    Failure::wrong(Message::new(
        format!(
            "`cdem resume {}`: resuming is not there yet",
            results.display()
        ),
        "run the scene again: `cdem run SCENE`, with --force to replace the interrupted run",
    ))
}
