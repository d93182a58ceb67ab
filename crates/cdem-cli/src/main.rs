//! The command `cdem`.

mod args;
mod check;
mod closing;
mod drive;
mod failure;
mod forecast;
mod interrupt;
mod memory;
mod new;
mod progress;
mod quantity;
mod report;
mod resume;
mod run;
mod schema;
mod setup;
mod terminal;

use std::process::ExitCode;

use clap::Parser as _;

use args::{Cli, Command};
use failure::{Failure, Message, Outcome};

fn main() -> ExitCode {
    memory::before_steps();
    let cli = Cli::parse();
    terminal::prepare();
    let ended = match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Check { scene } => check::check(&scene),
        Command::Resume(args) => resume::resume(&args),
        Command::New { template, folder } => new::new(template.as_deref(), folder),
        Command::Report { results } => report::report(&results),
        Command::Schema => schema::schema(),
    };
    ended
        .and_then(printed)
        .unwrap_or_else(|failure| {
            terminal::complain(&failure);
            failure.outcome
        })
        .into()
}

/// Turns a done command into a failure if its output could not be printed.
fn printed(outcome: Outcome) -> Result<Outcome, Failure> {
    match terminal::lost() {
        Some(reason) if outcome == Outcome::Done => Err(Failure::stopped(Message::new(
            format!("cannot write to standard output: {reason}"),
            "free space on the disk, or choose another output",
        ))),
        _ => Ok(outcome),
    }
}
