//! Drives a run from one of its steps to its end.

use std::time::{Duration, Instant};

use cdem::output::{BlockRow, HistoryRow};
use cdem::{Simulation, StepError};
use cdem_io::results::{End, Recording, ResultsError, Status};

use crate::closing::{self, Closing};
use crate::failure::{COMMAND, Failure, Message, Outcome};
use crate::interrupt::Interrupt;
use crate::memory;
use crate::progress::{Position, Progress};
use crate::quantity::counted;
use crate::terminal::{complain, warn};

/// State at start or end, for the closing summary.
pub(crate) struct Observation {
    pub(crate) history: HistoryRow,
    pub(crate) blocks: Vec<BlockRow>,
}

impl Observation {
    /// Observes the current state. Restarts the mean of the contact forces, so it is only for the
    /// start and the end of a run.
    pub(crate) fn of(simulation: &mut Simulation) -> Self {
        Self {
            history: simulation.history(),
            blocks: simulation.block_rows(),
        }
    }
}

/// Wall-clock times of this process.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Times {
    /// Reading, checking, building.
    pub(crate) setup: Duration,
    /// The step loop, including its output.
    pub(crate) wall: Duration,
    /// Output in the step loop.
    pub(crate) output: Duration,
}

/// A run with its results folder.
pub(crate) struct Run {
    pub(crate) simulation: Simulation,
    pub(crate) recording: Recording,
    pub(crate) interrupt: Interrupt,
    /// State at t = 0.
    pub(crate) start: Observation,
    pub(crate) times: Times,
    /// Warnings of losses that the user has seen during the run.
    pub(crate) told: Vec<String>,
    /// True if the time of each stage is to be reported at the end.
    pub(crate) profile: bool,
}

/// End of a run, and its error, if any.
struct Ended {
    end: End,
    failure: Option<Failure>,
    /// True if the state is to be written to a checkpoint.
    is_kept: bool,
}

impl Ended {
    fn done(simulation: &Simulation) -> Self {
        Self {
            end: End::done(simulation),
            failure: None,
            is_kept: false,
        }
    }

    fn interrupted(simulation: &Simulation) -> Self {
        Self {
            end: End::interrupted(simulation),
            failure: None,
            is_kept: true,
        }
    }

    fn refused(error: &ResultsError, has_checkpoint: bool) -> Self {
        let then = match (error, has_checkpoint) {
            (ResultsError::Gone { .. }, _) => "",
            (_, true) => "; then resume from the last checkpoint with `cdem resume`",
            (_, false) => "; then run the scene again, because there is no checkpoint yet",
        };
        let help = format!("{}{then}", error.help(&COMMAND));
        Self {
            end: End::stopped(error.to_string()),
            failure: Some(Failure::stopped(Message::new(error, help))),
            is_kept: false,
        }
    }

    fn unsound(error: &StepError) -> Self {
        let help = "the results up to then are complete; look at the last frame for the cause";
        Self {
            end: End::stopped(error.to_string()),
            failure: Some(Failure::stopped(Message::new(error, help))),
            is_kept: true,
        }
    }
}

impl Run {
    /// Makes all steps, writes the results, and prints the closing summary.
    pub(crate) fn finish(mut self) -> Outcome {
        memory::while_stepping();
        if self.profile {
            self.simulation.time_stages();
        }
        let mut ended = self.drive();
        if ended.is_kept
            && let Err(error) = self.keep_last(&ended.end)
        {
            ended.failure.get_or_insert(full_disk(&error));
        }
        let wall = self.times.wall;
        let recording = self.recording;
        let summary = recording.summary(&mut self.simulation, wall, &ended.end);
        for warning in self.simulation.warnings() {
            if !self.told.contains(&warning) {
                warn(&warning);
            }
        }
        let folder = recording.folder().to_owned();
        let goes_on = ended.end.status == Status::Interrupted && recording.has_checkpoint();
        let written = recording.finish(&mut self.simulation, &summary);
        let failure = written.as_ref().err().map(full_disk);
        if let Some(failure) = ended.failure.or(failure) {
            complain(&failure);
        }
        if written.is_err() {
            return Outcome::Stopped;
        }
        closing::print(&Closing {
            dimension: self.simulation.scene().dimension,
            mass: moving_mass(&self.simulation),
            summary: &summary,
            start: &self.start,
            end: &Observation::of(&mut self.simulation),
            exchanged: self.simulation.energy_exchanged(),
            folder: &folder,
            goes_on,
            profile: self
                .profile
                .then(|| (self.times, self.simulation.stage_times())),
        });
        match ended.end.status {
            Status::Done => Outcome::Done,
            Status::Stopped => Outcome::Stopped,
            Status::Interrupted => Outcome::Interrupted,
        }
    }

    /// Steps and records until the run is done, stops itself, or is interrupted.
    fn drive(&mut self) -> Ended {
        let began = Instant::now();
        let mut progress = Progress::start(self.position());
        let ended = loop {
            let observed = Instant::now();
            let written = self
                .recording
                .observe(&mut self.simulation, || began.elapsed());
            if let Err(error) = written {
                break Ended::refused(&error, self.recording.has_checkpoint());
            }
            self.times.output += observed.elapsed();
            if self.simulation.finished() {
                break Ended::done(&self.simulation);
            }
            if self.interrupt.asked() {
                break Ended::interrupted(&self.simulation);
            }
            if let Err(error) = self.recording.step(&mut self.simulation) {
                break Ended::unsound(&error);
            }
            for warning in self.simulation.take_loss_warnings() {
                progress.suspend(|| warn(&warning));
                self.told.push(warning);
            }
            progress.update(|| self.position());
        };
        progress.end();
        self.times.wall = began.elapsed();
        ended
    }

    /// Writes a checkpoint at the end of this process, unless the scene disables checkpoints.
    fn keep_last(&mut self, end: &End) -> Result<(), ResultsError> {
        if self.simulation.scene().output.checkpoint == 0.0 {
            return Ok(());
        }
        let stopped = end.status == Status::Stopped;
        let stopped = stopped.then(|| end.reason.clone());
        self.recording
            .keep(&self.simulation, self.times.wall, stopped)
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

/// Returns the mass of all blocks that can move, kg.
fn moving_mass(simulation: &Simulation) -> f64 {
    let blocks = simulation.overview().blocks.into_iter();
    blocks
        .filter(|block| !block.fixed)
        .map(|block| block.mass)
        .sum()
}

/// Starts the threads for the steps, with the current thread as one of them. Otherwise each
/// parallel task would first be handed over to another thread, and its result back.
pub(crate) fn use_threads(threads: Option<u16>) -> Result<(), Failure> {
    let named = || std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok();
    // 0 means one for each processor.
    let count = threads.map(usize::from).or_else(named).unwrap_or(0);
    let processors = std::thread::available_parallelism().map_or(usize::MAX, usize::from);
    if count > processors {
        warn(&format!(
            "{count} threads on {}: threads share processors, so the run takes longer",
            counted(processors as u64, "processor")
        ));
    }
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

/// Returns the failure of a folder that cannot be used; nothing has been written.
pub(crate) fn wrong_folder(error: ResultsError) -> Failure {
    Failure::wrong(Message::new(&error, error.help(&COMMAND)))
}

/// Returns the failure of a write in the middle of a run.
pub(crate) fn full_disk(error: &ResultsError) -> Failure {
    Failure::stopped(Message::new(error, error.help(&COMMAND)))
}
