//! Results of a run, step by step; shared by all drivers of a run.

use std::path::Path;
use std::time::{Duration, Instant};

use cdem::scene::Scene;
use cdem::{Simulation, StepError, quantity};

use super::checkpoint::SoFar;
use super::error::ResultsError;
use super::recorder::Recorder;
use super::summary::{Ending, Status, Summary};

/// The results of a run in progress, and its checkpoints.
///
/// The wall-clock times that its methods take are those of the step loops of this process, up to
/// now.
pub struct Recording {
    recorder: Recorder,
    /// Data from before the step loops of this process.
    so_far: SoFar,
    /// Time of the last checkpoint.
    kept: Instant,
}

/// End of a run in this process.
#[derive(Clone, Debug)]
pub struct End {
    /// Status.
    pub status: Status,
    /// Reason.
    pub reason: String,
}

impl End {
    /// Returns the end of a run that is done.
    #[must_use]
    pub fn done(simulation: &Simulation) -> Self {
        let reason = match &simulation.scene().time.stop_when {
            Some(stop) if simulation.step_index() < simulation.step_count() => format!(
                "time.stop_when: the kinetic energy has stayed below the threshold for {}",
                quantity(stop.during, "s")
            ),
            _ => "reached the end".to_owned(),
        };
        Self {
            status: Status::Done,
            reason,
        }
    }

    /// Returns the end of a run that the user interrupts now.
    #[must_use]
    pub fn interrupted(simulation: &Simulation) -> Self {
        Self {
            status: Status::Interrupted,
            reason: format!("interrupted at t = {}", quantity(simulation.time(), "s")),
        }
    }

    /// Returns the end of a run that stops itself.
    #[must_use]
    pub fn stopped(reason: String) -> Self {
        Self {
            status: Status::Stopped,
            reason,
        }
    }
}

impl Recording {
    /// Starts the recording with `recorder`. `so_far` is the earlier data of the run, including the
    /// setup of this process.
    #[must_use]
    pub fn new(recorder: Recorder, so_far: SoFar) -> Self {
        Self {
            recorder,
            so_far,
            kept: Instant::now(),
        }
    }

    /// Returns the path of the results folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.recorder.folder()
    }

    /// True if there is a checkpoint to continue from.
    #[must_use]
    pub fn has_checkpoint(&self) -> bool {
        self.recorder.has_checkpoint()
    }

    /// Writes what is due, and a checkpoint if the last one is old enough; to be called at the
    /// start and after each step.
    ///
    /// # Errors
    /// If writing fails.
    pub fn observe(
        &mut self,
        simulation: &mut Simulation,
        wall: impl FnOnce() -> Duration,
    ) -> Result<(), ResultsError> {
        self.recorder.observe(simulation)?;
        let interval = simulation.scene().output.checkpoint;
        let is_due = interval > 0.0 && self.kept.elapsed().as_secs_f64() >= interval;
        if is_due && self.recorder.may_keep() {
            self.kept = Instant::now();
            let so_far = self.so_far(wall());
            self.recorder.keep(simulation, so_far)?;
        }
        Ok(())
    }

    /// Makes one coarse step, with a check of the elements if something is due for output.
    ///
    /// # Errors
    /// If the run has become unphysical.
    pub fn step(&self, simulation: &mut Simulation) -> Result<(), StepError> {
        simulation.step()?;
        if self.recorder.is_due(simulation.time()) {
            simulation.check_elements()?;
        }
        Ok(())
    }

    /// Writes a checkpoint now; to be called after [`Self::observe`]. `stopped` is the reason if
    /// the run has stopped itself.
    ///
    /// # Errors
    /// If writing fails.
    pub fn keep(
        &mut self,
        simulation: &Simulation,
        wall: Duration,
        stopped: Option<String>,
    ) -> Result<(), ResultsError> {
        let so_far = SoFar {
            stopped,
            ..self.so_far(wall)
        };
        self.recorder.keep(simulation, so_far)?;
        self.recorder.wait()
    }

    /// Records changed loads of the scene: see [`Recorder::change_loads`].
    ///
    /// # Errors
    /// As [`Recorder::change_loads`].
    pub fn change_loads(&mut self, scene: &Scene) -> Result<(), ResultsError> {
        self.recorder.change_loads(scene)
    }

    /// Returns the summary of a run that ends here.
    pub fn summary(&self, simulation: &mut Simulation, wall: Duration, end: &End) -> Summary {
        let ending = Ending {
            status: end.status,
            reason: end.reason.clone(),
            so_far: self.so_far(wall),
            threads: rayon::current_num_threads(),
        };
        Summary::new(simulation, ending)
    }

    /// Writes the rest of the results and the summary: see [`Recorder::finish`].
    ///
    /// # Errors
    /// If writing fails.
    pub fn finish(
        self,
        simulation: &mut Simulation,
        summary: &Summary,
    ) -> Result<(), ResultsError> {
        self.recorder.finish(simulation, summary)
    }

    /// Returns the driver's data of the run up to now.
    fn so_far(&self, wall: Duration) -> SoFar {
        SoFar {
            wall_seconds: self.so_far.wall_seconds + wall.as_secs_f64(),
            ..self.so_far.clone()
        }
    }
}
