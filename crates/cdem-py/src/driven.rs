//! A simulation and the results that it writes.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use std::{mem, process};

use cdem::Simulation;
use cdem::output::FieldValues;
use cdem::scene::{Field, as_input, from_value};
use cdem_io::results::{End, Folder, Found, Recorder, Recording, ResultsError, SoFar, Unfinished};
use cdem_io::scene::SceneError;

use crate::errors::{Fault, guarded};
use crate::pool::pool;

/// A simulation, and its results if it writes any.
pub(crate) struct Driven {
    pub(crate) simulation: Simulation,
    pub(crate) recording: Option<Recording>,
    /// Warnings from before the first step.
    pub(crate) warnings: Vec<String>,
    /// Wall-clock time of the setup, and of the steps.
    setup: Duration,
    wall: Duration,
    /// The fault after which the run cannot continue, if any.
    failed: Option<Fault>,
    /// Process that owns the results.
    process: u32,
}

/// Limits of an advance.
#[derive(Clone, Copy)]
pub(crate) struct Leg {
    /// Time, s.
    pub(crate) until: f64,
    /// Coarse steps.
    pub(crate) steps: u64,
    /// Wall-clock time, s.
    pub(crate) seconds: f64,
}

impl Driven {
    /// Creates a run at t = 0; `began` is the start of its setup.
    pub(crate) fn new(simulation: Simulation, warnings: Vec<String>, began: Instant) -> Self {
        Self {
            simulation,
            recording: None,
            warnings,
            setup: began.elapsed(),
            wall: Duration::ZERO,
            failed: None,
            process: process::id(),
        }
    }

    /// Loads the run in a results folder from its last checkpoint.
    pub(crate) fn load(folder: PathBuf, is_recorded: bool, began: Instant) -> Result<Self, Fault> {
        let unfinished = match Unfinished::find(&folder)? {
            Found::Unfinished(unfinished) => *unfinished,
            Found::Done { reason } => {
                let text = format!(
                    "the run in {} is done: {reason} (`read_results()` reads its results)",
                    folder.display()
                );
                return Err(Fault::Results(text));
            }
        };
        if let Some(reason) = unfinished.so_far.stopped {
            return Err(ResultsError::Stopped { reason }.into());
        }
        let simulation = Simulation::new(&unfinished.scene, unfinished.mesh)
            .map_err(|error| Fault::Scene(error.to_string()))?;
        let simulation = simulation
            .resumed(&unfinished.run)
            .map_err(ResultsError::from)?;
        let mut so_far = unfinished.so_far;
        let warnings = so_far.warnings.clone();
        so_far.setup_seconds += began.elapsed().as_secs_f64();
        let recording = match is_recorded {
            true => Some(Recording::new(
                Recorder::reopen(unfinished.left_off)?,
                so_far,
            )),
            false => None,
        };
        Ok(Self {
            simulation,
            recording,
            warnings,
            setup: began.elapsed(),
            wall: Duration::ZERO,
            failed: None,
            process: process::id(),
        })
    }

    /// Returns an error if the state is unphysical or incomplete.
    fn check(&self) -> Result<(), Fault> {
        self.failed.clone().map_or(Ok(()), Err)
    }

    /// Does `work` on `threads` threads. In a forked process this is a copy that writes no results,
    /// because it owns neither the files nor the threads that write them.
    pub(crate) fn work<T: Send>(
        &mut self,
        threads: usize,
        work: impl FnOnce(&mut Self) -> Result<T, Fault> + Send,
    ) -> Result<T, Fault> {
        if self.process != process::id() {
            mem::forget(self.recording.take());
            self.process = process::id();
        }
        let driven = &mut *self;
        let done = pool(threads)?.install(|| guarded(|| work(driven)));
        if let Err(fault @ Fault::Defect(_)) = &done {
            // The state may be incomplete after a defect. The results end with the data written so
            // far and can be resumed from their last checkpoint.
            self.failed = Some(fault.clone());
            self.recording = None;
        }
        done
    }

    /// Begins to write results.
    pub(crate) fn record(&mut self, folder: &Path, scene: &Path, force: bool) -> Result<(), Fault> {
        self.check()?;
        if let Some(recording) = &self.recording {
            return Err(Fault::Results(format!(
                "the run already writes to {}; call close() first",
                recording.folder().display()
            )));
        }
        self.recording = Some(self.begin(folder, scene, force)?);
        Ok(())
    }

    /// Creates a new results folder.
    fn begin(&self, folder: &Path, scene: &Path, force: bool) -> Result<Recording, Fault> {
        let folder = Folder::claim(folder, scene, force)?;
        let directory = scene.parent().unwrap_or(Path::new(""));
        let recorder = Recorder::create(&folder, self.simulation.scene(), directory)
            .map_err(|unprepared| Fault::from(unprepared.error))?;
        let so_far = SoFar {
            setup_seconds: self.setup.as_secs_f64(),
            warnings: self.warnings.clone(),
            ..SoFar::default()
        };
        Ok(Recording::new(recorder, so_far))
    }

    /// Steps and records. Returns true if the time or the end is reached, and the number of steps.
    pub(crate) fn advance(&mut self, leg: Leg) -> Result<(bool, u64), Fault> {
        self.check()?;
        let began = Instant::now();
        let first = self.simulation.step_index();
        let advanced = self.steps(leg, began);
        self.wall += began.elapsed();
        if let Err(Fault::Step(reason) | Fault::Results(reason)) = &advanced {
            self.stop(reason, matches!(advanced, Err(Fault::Step(_))));
        }
        let is_there = advanced?;
        if self.simulation.finished() {
            self.end(&End::done(&self.simulation))?;
        }
        Ok((is_there, self.simulation.step_index() - first))
    }

    fn steps(&mut self, leg: Leg, began: Instant) -> Result<bool, Fault> {
        // Round-off may leave a whole number of steps just short of a time.
        let slack = 1e-6 * self.simulation.overview().step;
        let mut left = leg.steps;
        loop {
            let before = self.wall;
            if let Some(recording) = &mut self.recording {
                recording.observe(&mut self.simulation, || before + began.elapsed())?;
            }
            if self.simulation.finished() || self.simulation.time() + slack >= leg.until {
                return Ok(true);
            }
            if left == 0 || began.elapsed().as_secs_f64() >= leg.seconds {
                return Ok(false);
            }
            left -= 1;
            match &self.recording {
                Some(recording) => recording.step(&mut self.simulation),
                None => self.simulation.step(),
            }
            .map_err(|error| Fault::Step(error.to_string()))?;
        }
    }

    /// Ends the results of a run that has become unphysical, or whose disk has failed; the latter
    /// may be resumed. Errors of the disk are ignored here, because `reason` is already being
    /// reported.
    fn stop(&mut self, reason: &str, is_unphysical: bool) {
        if is_unphysical {
            self.failed = Some(Fault::Step(reason.to_owned()));
            if let Some(recording) = &mut self.recording {
                let _ = recording.keep(&self.simulation, self.wall, Some(reason.to_owned()));
            }
        }
        let _ = self.end(&End::stopped(reason.to_owned()));
    }

    /// Ends the results, if any are written.
    fn end(&mut self, end: &End) -> Result<(), Fault> {
        let Some(recording) = self.recording.take() else {
            return Ok(());
        };
        let summary = recording.summary(&mut self.simulation, self.wall, end);
        Ok(recording.finish(&mut self.simulation, &summary)?)
    }

    /// Ends the results here, with a checkpoint.
    pub(crate) fn close(&mut self) -> Result<(), Fault> {
        let Some(recording) = &mut self.recording else {
            return Ok(());
        };
        let wall = self.wall;
        recording.observe(&mut self.simulation, || wall)?;
        if self.simulation.finished() {
            return self.end(&End::done(&self.simulation));
        }
        recording.keep(&self.simulation, wall, None)?;
        self.end(&End::interrupted(&self.simulation))
    }

    /// Writes a checkpoint.
    pub(crate) fn save(
        &mut self,
        folder: Option<PathBuf>,
        scene: &Path,
        force: bool,
    ) -> Result<(), Fault> {
        self.check()?;
        let wall = self.wall;
        match (&mut self.recording, folder) {
            (Some(recording), None) => {
                recording.observe(&mut self.simulation, || wall)?;
                Ok(recording.keep(&self.simulation, wall, None)?)
            }
            // Nothing is observed. Ended contacts stay in the checkpoint, and the first rows are
            // written after it is resumed.
            (_, Some(folder)) => {
                let mut recording = self.begin(&folder, scene, force)?;
                Ok(recording.keep(&self.simulation, wall, None)?)
            }
            (None, None) => Err(Fault::Results(
                "the run has no results folder for a checkpoint; name a folder".to_owned(),
            )),
        }
    }

    /// Sets the velocities of the points of a block, or of all points. `values` are flat, with
    /// `components` each, for every point or one for all.
    pub(crate) fn set_velocities(
        &mut self,
        block: Option<&str>,
        values: &[f64],
        components: usize,
    ) -> Result<(), Fault> {
        self.check()?;
        let field = self.simulation.field(Field::Velocity);
        let FieldValues::Real(mut velocities) = field.values else {
            unreachable!("velocities are real numbers");
        };
        let (velocities, _) = velocities.as_chunks_mut::<3>();
        let points = match block {
            None => 0..velocities.len(),
            Some(name) => {
                let mut ranges = self.simulation.block_ranges().into_iter();
                let range = ranges.find(|range| range.name == name);
                let unknown = || Fault::Value(format!("there is no block \"{name}\""));
                range.ok_or_else(unknown)?.points
            }
        };
        let chosen = &mut velocities[points];
        let given = values.len() / components;
        if given != 1 && given != chosen.len() {
            let count = chosen.len();
            return Err(Fault::Value(format!(
                "expected one velocity, or one for each of {count} points, got {given}"
            )));
        }
        let each = values.chunks_exact(components).cycle();
        for (velocity, value) in chosen.iter_mut().zip(each) {
            velocity[..components].copy_from_slice(value);
        }
        self.simulation.set_velocities(velocities);
        Ok(())
    }

    /// Changes a load from now on.
    pub(crate) fn set_load(&mut self, number: usize, kind: &str, value: &str) -> Result<(), Fault> {
        self.check()?;
        let unreadable = |error: serde_json::Error| Fault::Scene(format!("load: {error}"));
        let scene = as_input(self.simulation.scene());
        let mut input = serde_json::to_value(scene).map_err(unreadable)?;
        input["load"][number][kind] = serde_json::from_str(value).map_err(unreadable)?;
        let scene =
            from_value(input).map_err(|problems| Fault::from(SceneError::Unwritten(problems)))?;
        let new = &scene.load[number].kind;
        if let Some(recording) = &mut self.recording {
            // First, so that the run is unchanged if the disk fails.
            recording.change_loads(&self.simulation.scene_with_load(number, new))?;
        }
        self.simulation.set_load(number, new);
        Ok(())
    }
}
