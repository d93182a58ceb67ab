//! A run and the results of it, step by step: what every driver of a run does.

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
/// Wall-clock times that its methods ask for are those of the step loops of this process, up to
/// now.
pub struct Recording {
    recorder: Recorder,
    /// Before the step loops of this process.
    so_far: SoFar,
    /// When the last checkpoint was written.
    kept: Instant,
}

/// How a run ends in this process.
#[derive(Clone, Debug)]
pub struct End {
    /// How.
    pub status: Status,
    /// Why.
    pub reason: String,
}

impl End {
    /// The run has come to its end.
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

    /// The user stops it where it is.
    #[must_use]
    pub fn interrupted(simulation: &Simulation) -> Self {
        Self {
            status: Status::Interrupted,
            reason: format!("interrupted at t = {}", quantity(simulation.time(), "s")),
        }
    }

    /// It stops itself.
    #[must_use]
    pub fn stopped(reason: String) -> Self {
        Self {
            status: Status::Stopped,
            reason,
        }
    }
}

impl Recording {
    /// What `recorder` writes, `so_far` being known of the run, the setup of this process
    /// included.
    #[must_use]
    pub fn new(recorder: Recorder, so_far: SoFar) -> Self {
        Self {
            recorder,
            so_far,
            kept: Instant::now(),
        }
    }

    /// The folder of the results.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.recorder.folder()
    }

    /// Whether there is a checkpoint to go on from.
    #[must_use]
    pub fn has_checkpoint(&self) -> bool {
        self.recorder.has_checkpoint()
    }

    /// Writes what is due, and a checkpoint where the last is old enough; to be called at the
    /// start and after each step.
    ///
    /// # Errors
    /// If the disk refuses.
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

    /// One coarse step, with a look at the elements where something is to be
    /// written of them.
    ///
    /// # Errors
    /// When the run has become unphysical.
    pub fn step(&self, simulation: &mut Simulation) -> Result<(), StepError> {
        simulation.step()?;
        if self.recorder.is_due(simulation.time()) {
            simulation.check_elements()?;
        }
        Ok(())
    }

    /// Writes a checkpoint now; to be called after [`Self::observe`]. `stopped` says why the
    /// run has stopped itself, if it has.
    ///
    /// # Errors
    /// If the disk refuses.
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

    /// Takes note that the loads of the scene are others from now on: see
    /// [`Recorder::change_loads`].
    ///
    /// # Errors
    /// As there.
    pub fn change_loads(&mut self, scene: &Scene) -> Result<(), ResultsError> {
        self.recorder.change_loads(scene)
    }

    /// The summary of a run that ends here.
    pub fn summary(&self, simulation: &mut Simulation, wall: Duration, end: &End) -> Summary {
        let ending = Ending {
            status: end.status,
            reason: end.reason.clone(),
            so_far: self.so_far(wall),
            threads: rayon::current_num_threads(),
        };
        Summary::new(simulation, ending)
    }

    /// Writes what is still missing, the summary too: see [`Recorder::finish`].
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn finish(
        self,
        simulation: &mut Simulation,
        summary: &Summary,
    ) -> Result<(), ResultsError> {
        self.recorder.finish(simulation, summary)
    }

    /// What is known of the run up to now.
    fn so_far(&self, wall: Duration) -> SoFar {
        SoFar {
            wall_seconds: self.so_far.wall_seconds + wall.as_secs_f64(),
            ..self.so_far.clone()
        }
    }
}
