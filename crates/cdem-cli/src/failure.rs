//! Failures of the command, and its exit status.

use std::fmt::Display;
use std::process::ExitCode;

use cdem_io::results::Front;
use cdem_io::scene::SceneError;

/// Words of the command line for advice of the libraries.
pub(crate) const COMMAND: Front = Front {
    naming: " with -o DIR",
    force: "--force",
    run: "`cdem run`",
    resume: "`cdem resume`",
};

/// Outcome of the command, reported as its exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Everything is done.
    Done,
    /// The call or the scene is wrong; nothing was written.
    Wrong,
    /// The run stopped itself.
    Stopped,
    /// The user stopped it.
    Interrupted,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        Self::from(match outcome {
            Outcome::Done => 0,
            Outcome::Wrong => 2,
            Outcome::Stopped => 3,
            Outcome::Interrupted => INTERRUPTED,
        })
    }
}

/// Exit status of an interrupted run: 128 + SIGINT, as in shells.
pub(crate) const INTERRUPTED: u8 = 130;

/// Failure of a command.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) outcome: Outcome,
    pub(crate) cause: Cause,
}

/// Cause of a failure, for display.
#[derive(Debug)]
pub(crate) enum Cause {
    /// An error in a scene, shown in its text.
    Scene(SceneError),
    /// Any other error.
    Message(Message),
}

/// Problem and advice; the help may be empty.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) problem: String,
    pub(crate) help: String,
}

impl Failure {
    /// Creates the failure of a wrong call or scene.
    pub(crate) fn wrong(cause: impl Into<Cause>) -> Self {
        Self {
            outcome: Outcome::Wrong,
            cause: cause.into(),
        }
    }

    /// Creates the failure of a run that stopped itself.
    pub(crate) fn stopped(cause: impl Into<Cause>) -> Self {
        Self {
            outcome: Outcome::Stopped,
            cause: cause.into(),
        }
    }
}

impl Message {
    pub(crate) fn new(problem: impl Display, help: impl Display) -> Self {
        Self {
            problem: problem.to_string(),
            help: help.to_string(),
        }
    }
}

impl From<SceneError> for Cause {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<Message> for Cause {
    fn from(message: Message) -> Self {
        Self::Message(message)
    }
}
