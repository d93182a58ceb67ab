//! `cdem run`: a scene from its file to its results.

use std::time::{Duration, Instant};

use cdem::sample::{BlockRow, HistoryRow};
use cdem::{Simulation, StepError};
use cdem_io::results::{Ending, Folder, Recorder, ResultsError, Status, Summary, Unprepared};

use crate::args::RunArgs;
use crate::closing::{self, Closing};
use crate::failure::{Failure, Message, Outcome};
use crate::interrupt::Interrupt;
use crate::progress::{Position, Progress};
use crate::quantity::quantity;
use crate::setup;
use crate::terminal::{complain, warn};

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Failure> {
    let Started {
        mut run,
        mut recorder,
        interrupt,
        folder,
        start,
        warnings,
    } = start(args)?;
    if args.profile {
        run.simulation.time_stages();
    }
    let (status, reason, failure) = run.drive(&mut recorder, &interrupt);
    let summary = run.summary(status, reason, warnings);
    for warning in run.simulation.warnings() {
        warn(&warning);
    }
    let written = recorder.finish(&mut run.simulation, &summary);
    let failure = failure.or_else(|| written.as_ref().err().map(full_disk));
    if let Some(failure) = failure {
        complain(&failure);
    }
    if written.is_err() {
        return Ok(Outcome::Stopped);
    }
    closing::print(&Closing {
        dimension: run.simulation.scene().dimension,
        mass: moving_mass(&run.simulation),
        summary: &summary,
        start: &start,
        end: &run.observed(),
        exchanged: run.simulation.energy_exchanged(),
        folder: folder.path(),
        profile: args
            .profile
            .then(|| (run.times, run.simulation.stage_times())),
    });
    Ok(match status {
        Status::Done => Outcome::Done,
        Status::Stopped => Outcome::Stopped,
        Status::Interrupted => Outcome::Interrupted,
    })
}

/// A run that has its folder.
struct Started {
    run: Run,
    recorder: Recorder,
    interrupt: Interrupt,
    folder: Folder,
    start: Observation,
    /// What the user has been warned of.
    warnings: Vec<String>,
}

/// Reads, checks and builds; only then the folder is touched.
fn start(args: &RunArgs) -> Result<Started, Failure> {
    let began = Instant::now();
    let folder = args
        .output
        .clone()
        .unwrap_or_else(|| Folder::beside(&args.scene));
    // The scene first: a wrong path to it would be reported as no folder.
    let file = setup::read(&args.scene)?;
    let folder = Folder::claim(&folder, &args.scene, args.force).map_err(wrong_folder)?;
    use_threads(args.threads)?;
    let built = setup::build(&file)?;
    for warning in &built.warnings {
        warn(warning);
    }
    let mut run = Run {
        simulation: built.simulation,
        times: Times::default(),
    };
    let start = run.observed();
    let interrupt = Interrupt::listen()?;
    let recorder = Recorder::create(&folder, run.simulation.scene(), file.directory()).map_err(
        |Unprepared { error, touched }| match touched {
            false => wrong_folder(error),
            true => full_disk(&error),
        },
    )?;
    run.times.setup = began.elapsed();
    Ok(Started {
        run,
        recorder,
        interrupt,
        folder,
        start,
        warnings: built.warnings,
    })
}

/// Mass of all blocks that may move, kg.
fn moving_mass(simulation: &Simulation) -> f64 {
    let blocks = simulation.overview().blocks.into_iter();
    blocks
        .filter(|block| !block.fixed)
        .map(|block| block.mass)
        .sum()
}

/// What the closing summary compares.
pub(crate) struct Observation {
    pub(crate) history: HistoryRow,
    pub(crate) blocks: Vec<BlockRow>,
}

/// Where the wall-clock time went.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Times {
    /// Reading, checking, building.
    pub(crate) setup: Duration,
    /// The step loop with its output.
    pub(crate) wall: Duration,
    /// Output within the step loop.
    pub(crate) output: Duration,
}

struct Run {
    simulation: Simulation,
    times: Times,
}

impl Run {
    /// The state now. Ends the average of the contact forces: for the start and
    /// the end of a run only.
    fn observed(&mut self) -> Observation {
        Observation {
            history: self.simulation.history(),
            blocks: self.simulation.block_rows(),
        }
    }

    fn summary(&mut self, status: Status, reason: String, warnings: Vec<String>) -> Summary {
        let ending = Ending {
            status,
            reason,
            setup_seconds: self.times.setup.as_secs_f64(),
            wall_seconds: self.times.wall.as_secs_f64(),
            threads: rayon::current_num_threads(),
            warnings,
        };
        Summary::new(&mut self.simulation, ending)
    }

    /// Steps and records until the run is done, stops itself, or is stopped.
    fn drive(
        &mut self,
        recorder: &mut Recorder,
        interrupt: &Interrupt,
    ) -> (Status, String, Option<Failure>) {
        let began = Instant::now();
        let mut progress = Progress::start(self.simulation.step_count());
        let ended = loop {
            let observed = Instant::now();
            if let Err(error) = recorder.observe(&mut self.simulation) {
                break (Status::Stopped, error.to_string(), Some(full_disk(&error)));
            }
            self.times.output += observed.elapsed();
            if self.simulation.finished() {
                break (Status::Done, self.reason_of_end(), None);
            }
            if interrupt.asked() {
                let reason = format!(
                    "interrupted at t = {}",
                    quantity(self.simulation.time(), "s")
                );
                break (Status::Interrupted, reason, None);
            }
            if let Err(error) = self.step(recorder) {
                let help = "the results up to there are whole; the last frame shows what happened";
                let failure = Failure::stopped(Message::new(&error, help));
                break (Status::Stopped, error.to_string(), Some(failure));
            }
            progress.update(|| self.position());
        };
        progress.end();
        self.times.wall = began.elapsed();
        ended
    }

    /// One coarse step, with a look at the elements where something is to be
    /// written of them.
    fn step(&mut self, recorder: &Recorder) -> Result<(), StepError> {
        self.simulation.step()?;
        if recorder.is_due(self.simulation.time()) {
            self.simulation.check_elements()?;
        }
        Ok(())
    }

    fn reason_of_end(&self) -> String {
        match &self.simulation.scene().time.stop_when {
            Some(stop) if self.simulation.step_index() < self.simulation.step_count() => format!(
                "time.stop_when: the kinetic energy has stayed below the threshold for {}",
                quantity(stop.during, "s")
            ),
            _ => "reached the end".to_owned(),
        }
    }

    fn position(&self) -> Position {
        Position {
            step: self.simulation.step_index(),
            step_count: self.simulation.step_count(),
            time: self.simulation.time(),
            end: self.simulation.scene().time.end,
            element_updates: self.simulation.element_updates(),
        }
    }
}

/// Starts the threads that step, this one among them: else each piece of work that is
/// shared out would first have to be handed over to another thread, and back.
pub(crate) fn use_threads(threads: Option<u16>) -> Result<(), Failure> {
    let count = threads.map_or(0, usize::from); // 0: one for each processor
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count);
    pool.use_current_thread().build_global().map_err(|error| {
        let which = threads.map_or("the".to_owned(), |threads| threads.to_string());
        let message = format!("cannot start {which} threads: {error}");
        Failure::wrong(Message::new(
            message,
            "ask for fewer: `cdem run --threads 1`",
        ))
    })
}

fn wrong_folder(error: ResultsError) -> Failure {
    Failure::wrong(Message::new(&error, error.help()))
}

fn full_disk(error: &ResultsError) -> Failure {
    Failure::stopped(Message::new(error, error.help()))
}
