//! Errors on their way to the terminal, and the exit status.

use std::fmt::Display;
use std::process::ExitCode;

use cdem_io::results::Front;
use cdem_io::scene::SceneError;

/// How advice of the libraries is followed with the command.
pub(crate) const COMMAND: Front = Front {
    naming: " with -o DIR",
    force: "--force",
    run: "`cdem run`",
    resume: "`cdem resume`",
};

/// How the command ends, as the exit status says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All is done.
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

/// Exit status of an interrupted run: 128 + SIGINT, as shells have it.
pub(crate) const INTERRUPTED: u8 = 130;

/// Why a command did not do what it was asked.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) outcome: Outcome,
    pub(crate) cause: Cause,
}

/// What is shown.
#[derive(Debug)]
pub(crate) enum Cause {
    /// Something in a scene, shown in its text.
    Scene(SceneError),
    /// Anything else.
    Message(Message),
}

/// What is wrong, and what to try; the help may be empty.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) problem: String,
    pub(crate) help: String,
}

impl Failure {
    /// The call or the scene is wrong.
    pub(crate) fn wrong(cause: impl Into<Cause>) -> Self {
        Self {
            outcome: Outcome::Wrong,
            cause: cause.into(),
        }
    }

    /// The run stopped itself.
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
