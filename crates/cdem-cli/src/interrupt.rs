//! Ctrl-C and requests to terminate.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::{Failure, INTERRUPTED, Message};

/// True once the user has asked the run to stop.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Installs the handler: the first Ctrl-C (or SIGTERM, SIGHUP) asks the run to stop after its
    /// step; the second ends the program at once.
    pub(crate) fn listen() -> Result<Self, Failure> {
        let interrupt = Self::default();
        let asked = interrupt.clone();
        ctrlc::set_handler(move || {
            if asked.0.swap(true, Ordering::Relaxed) {
                // Rows and frames are complete at any instant, so no destructor is needed.
                #[allow(clippy::disallowed_methods)]
                std::process::exit(INTERRUPTED.into());
            }
        })
        .map_err(|error| {
            Failure::wrong(Message::new(
                format!("cannot listen to Ctrl-C: {error}"),
                "",
            ))
        })?;
        Ok(interrupt)
    }

    pub(crate) fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
