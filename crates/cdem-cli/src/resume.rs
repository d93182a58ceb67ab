//! `cdem resume`: continues a run from its last checkpoint.

use std::time::Instant;

use cdem::Simulation;
use cdem_io::results::{Found, Recorder, Recording, ResultsError, Unfinished};

use crate::args::ResumeArgs;
use crate::drive::{Observation, Run, Times, full_disk, use_threads, wrong_folder};
use crate::failure::{Failure, Message, Outcome};
use crate::interrupt::Interrupt;
use crate::quantity::quantity;
use crate::terminal::{print, say, warn};

pub(crate) fn resume(args: &ResumeArgs) -> Result<Outcome, Failure> {
    let began = Instant::now();
    match Unfinished::find(&args.results).map_err(wrong_folder)? {
        Found::Done { reason } => {
            let folder = args.results.display();
            print(format_args!("the run in {folder} is done: {reason}"));
            Ok(Outcome::Done)
        }
        Found::Unfinished(unfinished) => go_on(args, *unfinished, began).map(Run::finish),
    }
}

/// Restores the run; its results are changed only after that.
fn go_on(args: &ResumeArgs, unfinished: Unfinished, began: Instant) -> Result<Run, Failure> {
    if let Some(reason) = unfinished.so_far.stopped {
        return Err(full_disk(&ResultsError::Stopped { reason }));
    }
    use_threads(args.threads)?;
    for passed_over in &unfinished.passed_over {
        warn(&format!("{passed_over}; an earlier checkpoint is used"));
    }
    let mut simulation = Simulation::new(&unfinished.scene, unfinished.mesh)
        .map_err(|error| Failure::wrong(Message::new(&error, "")))?;
    let start = Observation::of(&mut simulation);
    let simulation = simulation
        .resumed(&unfinished.run)
        .map_err(|error| wrong_folder(error.into()))?;
    let interrupt = Interrupt::listen()?;
    say(format_args!(
        "resuming at t = {}, step {}",
        quantity(simulation.time(), "s"),
        simulation.step_index()
    ));
    let recorder = Recorder::reopen(unfinished.left_off).map_err(|error| full_disk(&error))?;
    let setup = began.elapsed();
    let mut so_far = unfinished.so_far;
    so_far.setup_seconds += setup.as_secs_f64();
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
