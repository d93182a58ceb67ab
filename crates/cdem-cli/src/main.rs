//! The command `cdem`.

mod args;
mod check;
mod closing;
mod failure;
mod interrupt;
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

fn main() -> ExitCode {
    let cli = Cli::parse();
    terminal::prepare();
    let ended = match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Check { scene } => check::check(&scene),
        Command::Resume { results } => Err(resume::resume(&results)),
        Command::New { template, folder } => new::new(template.as_deref(), folder),
        Command::Report { results } => Err(report::report(&results)),
        Command::Schema => schema::schema(),
    };
    let outcome = ended.unwrap_or_else(|failure| {
        terminal::complain(&failure);
        failure.outcome
    });
    outcome.into()
}
