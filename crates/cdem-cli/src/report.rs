//! `cdem report`: not there yet.

use std::path::Path;

use crate::failure::{Failure, Message};

pub(crate) fn report(results: &Path) -> Failure {
    Failure::wrong(Message::new(
        format!(
            "`cdem report {}`: reports are not there yet",
            results.display()
        ),
        "history.csv and blocks.csv open in any spreadsheet, frames.pvd in ParaView",
    ))
}
