//! `cdem run`: runs a scene from its file to its results.

use std::time::Instant;

use cdem_io::results::{Folder, Recorder, Recording, SoFar, Unprepared};

use crate::args::RunArgs;
use crate::drive::{Observation, Run, Times, full_disk, use_threads, wrong_folder};
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::setup;
use crate::terminal::warn;

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Failure> {
    start(args).map(Run::finish)
}

/// Reads, checks and builds; the folder is changed only after that.
fn start(args: &RunArgs) -> Result<Run, Failure> {
    let began = Instant::now();
    let folder = args
        .output
        .clone()
        .unwrap_or_else(|| Folder::beside(&args.scene));
    // The scene comes first: a wrong path to it would be reported as a fault of the folder.
    let file = setup::read(&args.scene)?;
    let folder = Folder::claim(&folder, &args.scene, args.force).map_err(wrong_folder)?;
    use_threads(args.threads)?;
    let built = setup::build(&file)?;
    for warning in &built.warnings {
        warn(warning);
    }
    let mut simulation = built.simulation;
    let start = Observation::of(&mut simulation);
    let interrupt = Interrupt::listen()?;
    let recorder = Recorder::create(&folder, simulation.scene(), file.directory()).map_err(
        |Unprepared { error, touched }| match touched {
            false => wrong_folder(error),
            true => full_disk(&error),
        },
    )?;
    let setup = began.elapsed();
    let so_far = SoFar {
        setup_seconds: setup.as_secs_f64(),
        warnings: built.warnings,
        ..SoFar::default()
    };
    Ok(Run {
        simulation,
        recording: Recording::new(recorder, so_far),
        interrupt,
        start,
        times: Times {
            setup,
            ..Times::default()
        },
        told: Vec::new(),
        profile: args.profile,
    })
}
