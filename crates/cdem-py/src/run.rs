//! A run, step by step.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use cdem::Simulation;
use cdem::scene::{as_input, from_value};
use cdem_io::results::{End, Folder, Found, Recorder, Recording, SoFar, Status, Unfinished};
use cdem_io::scene::SceneError;
use cdem_io::setup;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::sync::MutexExt as _;
use pyo3::types::PyDict;

use crate::errors::{Fault, guarded};
use crate::mesh::Mesh;
use crate::pool::pool;
use crate::scene::Source;
use crate::tables;

/// A simulation, and the results that it writes, if any.
#[pyclass(frozen, module = "cdem._engine")]
pub(crate) struct Run {
    driven: Mutex<Driven>,
    /// How many threads step; 0: one for each processor.
    threads: usize,
}

struct Driven {
    simulation: Simulation,
    recording: Option<Recording>,
    /// What is known before the first step.
    warnings: Vec<String>,
    /// Wall-clock time of the setup, and of steps.
    setup: Duration,
    wall: Duration,
    /// Why the run has stopped itself, if it has.
    failed: Option<String>,
}

/// How far to go at most.
#[derive(Clone, Copy)]
struct Leg {
    until: f64,
    steps: u64,
    seconds: f64,
}

#[pymethods]
impl Run {
    /// A run at its start. `meshes` are those at hand, under the path that the scene names.
    #[new]
    fn new(
        py: Python<'_>,
        source: &Source,
        meshes: Vec<(PathBuf, Bound<'_, Mesh>)>,
        threads: usize,
    ) -> PyResult<Self> {
        let began = Instant::now();
        let meshes = meshes.into_iter();
        let mut meshes = meshes
            .map(|(path, mesh)| (path, mesh.get().0.clone()))
            .collect();
        let built = on_pool(py, threads, || {
            Ok(setup::build(&source.read()?, &mut meshes)?)
        })?;
        Ok(Self::of(threads, built.simulation, built.warnings, began))
    }

    /// The run in a folder of results, from its last checkpoint; `is_recorded`: it goes on
    /// writing to that folder.
    #[staticmethod]
    fn load(py: Python<'_>, folder: PathBuf, is_recorded: bool, threads: usize) -> PyResult<Self> {
        let began = Instant::now();
        let driven = on_pool(py, threads, || Driven::load(folder, is_recorded, began))?;
        Ok(Self {
            driven: Mutex::new(driven),
            threads,
        })
    }

    /// Begins to write results to a folder; meshes are relative to that of the file `scene`.
    fn record(&self, py: Python<'_>, folder: PathBuf, scene: PathBuf, force: bool) -> PyResult<()> {
        self.work(py, |driven| driven.record(&folder, &scene, force))
    }

    /// Steps until a time, s, the end, or for so many steps or seconds of wall-clock time;
    /// whether that time or the end is reached.
    fn advance(&self, py: Python<'_>, until: f64, steps: u64, seconds: f64) -> PyResult<bool> {
        let leg = Leg {
            until,
            steps,
            seconds,
        };
        self.work(py, |driven| driven.advance(leg))
    }

    /// Ends the results here, with a checkpoint to go on from.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.work(py, Driven::close)
    }

    /// Writes a checkpoint: to the folder of the results, or to a new one.
    fn save(
        &self,
        py: Python<'_>,
        folder: Option<PathBuf>,
        scene: PathBuf,
        force: bool,
    ) -> PyResult<()> {
        self.work(py, |driven| driven.save(folder, &scene, force))
    }

    /// Folder of the results, if they are written.
    #[getter]
    fn folder(&self, py: Python<'_>) -> Option<PathBuf> {
        let driven = self.locked(py);
        let recording = driven.recording.as_ref();
        recording.map(|recording| recording.folder().to_owned())
    }

    /// Time, s.
    #[getter]
    fn time(&self, py: Python<'_>) -> f64 {
        self.locked(py).simulation.time()
    }

    /// End of the scene, s.
    #[getter]
    fn end(&self, py: Python<'_>) -> f64 {
        self.locked(py).simulation.scene().time.end
    }

    /// Coarse steps made.
    #[getter]
    fn step_index(&self, py: Python<'_>) -> u64 {
        self.locked(py).simulation.step_index()
    }

    /// Coarse steps of the whole run.
    #[getter]
    fn step_count(&self, py: Python<'_>) -> u64 {
        self.locked(py).simulation.step_count()
    }

    /// Length of the coarse step, s.
    #[getter]
    fn step_size(&self, py: Python<'_>) -> f64 {
        self.locked(py).simulation.overview().step
    }

    /// Updates of elements so far.
    #[getter]
    fn element_updates(&self, py: Python<'_>) -> u64 {
        self.locked(py).simulation.element_updates()
    }

    /// Whether the end is reached.
    #[getter]
    fn finished(&self, py: Python<'_>) -> bool {
        self.locked(py).simulation.finished()
    }

    /// The scene as TOML, every default filled in, loads as they have become.
    #[getter]
    fn scene(&self, py: Python<'_>) -> String {
        cdem_io::scene::write(self.locked(py).simulation.scene())
    }

    /// What the user should know.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.work(py, |driven| {
            let mut warnings = driven.warnings.clone();
            warnings.extend(driven.simulation.warnings());
            Ok(warnings)
        })
    }

    /// Energies, momenta and counts now.
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let row = self.work(py, |driven| Ok(driven.simulation.history()))?;
        tables::history(py, &row)
    }

    /// All blocks now, and where they lie in the arrays.
    fn blocks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (rows, ranges) = self.work(py, |driven| {
            let simulation = &mut driven.simulation;
            Ok((simulation.blocks(), simulation.block_ranges()))
        })?;
        let out = tables::blocks(py, &rows)?;
        let points: Vec<_> = ranges
            .iter()
            .map(|range| (range.points.start, range.points.end))
            .collect();
        let cells: Vec<_> = ranges
            .iter()
            .map(|range| (range.cells.start, range.cells.end))
            .collect();
        out.set_item("points", points)?;
        out.set_item("cells", cells)?;
        Ok(out)
    }

    /// Live contact points now.
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (rows, frame) = self.work(py, |driven| {
            let simulation = &driven.simulation;
            Ok((simulation.live_contacts(), simulation.contact_frame()))
        })?;
        let out = tables::contacts(py, &rows)?;
        tables::add_live(&out, frame)?;
        Ok(out)
    }

    /// Contacts that have ended since this was last asked; of a run that writes results they
    /// go there.
    fn ended_contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rows = self.work(py, |driven| match &driven.recording {
            None => Ok(driven.simulation.ended_contacts()),
            Some(recording) => Err(Fault::Results(format!(
                "contacts that have ended go to contacts.csv in {}; read them there",
                recording.folder().display()
            ))),
        })?;
        tables::contacts(py, &rows)
    }

    /// Places of all points, flat, m.
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let positions = self.work(py, |driven| Ok(driven.simulation.positions()))?;
        Ok(tables::flat(py, positions).into_any())
    }

    /// A field of points or cells, flat, and the number of its components.
    fn field<'py>(&self, py: Python<'py>, name: &str) -> PyResult<(Bound<'py, PyAny>, usize)> {
        let wanted = tables::field_of(name).ok_or_else(|| {
            pyo3::exceptions::PyValueError::new_err(format!(
                "there is no field \"{name}\": displacement, velocity, contact_force, stress, \
                 von_mises, principal_stress, level"
            ))
        })?;
        let field = self.work(py, |driven| Ok(driven.simulation.field(wanted)))?;
        let components = field.components.len().max(1);
        Ok((tables::field(py, field.values), components))
    }

    /// Kinds of all cells, and the points of all of them in a row.
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<(Vec<&'static str>, Bound<'py, PyAny>)> {
        let (kinds, points) = self.work(py, |driven| Ok(driven.simulation.cells()))?;
        let kinds = kinds.into_iter().map(tables::kind_name).collect();
        let points = numpy::IntoPyArray::into_pyarray(points, py);
        Ok((kinds, points.into_any()))
    }

    /// Gives the points other velocities, m/s, flat.
    fn set_velocities(
        &self,
        py: Python<'_>,
        velocities: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<()> {
        let velocities = velocities.as_slice()?.as_chunks().0.to_vec();
        self.work(py, |driven| {
            let points = driven.simulation.positions().len();
            if velocities.len() != points {
                let given = velocities.len();
                let text = format!("{given} velocities were given for {points} points");
                return Err(Fault::Step(text));
            }
            if velocities.as_flattened().iter().any(|v| !v.is_finite()) {
                return Err(Fault::Step("velocities must be finite numbers".to_owned()));
            }
            driven.simulation.set_velocities(&velocities);
            Ok(())
        })
    }

    /// Has a load push otherwise from now on: `kind` is "pressure" or "traction", `value` as
    /// JSON.
    fn set_load(&self, py: Python<'_>, number: usize, kind: &str, value: &str) -> PyResult<()> {
        self.work(py, |driven| driven.set_load(number, kind, value))
    }
}

impl Run {
    fn of(threads: usize, simulation: Simulation, warnings: Vec<String>, began: Instant) -> Self {
        let driven = Driven {
            simulation,
            recording: None,
            warnings,
            setup: began.elapsed(),
            wall: Duration::ZERO,
            failed: None,
        };
        Self {
            driven: Mutex::new(driven),
            threads,
        }
    }

    /// Waits for another thread that is stepping, while others go on. A step that has
    /// panicked has told so already.
    fn locked(&self, py: Python<'_>) -> MutexGuard<'_, Driven> {
        let locked = self.driven.lock_py_attached(py);
        locked.unwrap_or_else(PoisonError::into_inner)
    }

    /// Does some work on the threads of the run, while other threads of Python go on.
    fn work<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Driven) -> Result<T, Fault> + Send,
    ) -> PyResult<T> {
        // Locked before the threads are asked: one of them that waits for its share of a step
        // would else take up other work, and wait for itself.
        let done = py.detach(|| {
            let locked = self.driven.lock();
            let mut locked = locked.unwrap_or_else(PoisonError::into_inner);
            let driven = &mut *locked;
            pool(self.threads)?.install(|| guarded(|| work(driven)))
        });
        Ok(done?)
    }
}

/// Does some work on so many threads, while other threads of Python go on.
fn on_pool<T: Send>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce() -> Result<T, Fault> + Send,
) -> PyResult<T> {
    Ok(py.detach(|| pool(threads)?.install(|| guarded(work)))?)
}

impl Driven {
    fn load(folder: PathBuf, is_recorded: bool, began: Instant) -> Result<Self, Fault> {
        let unfinished = match Unfinished::find(&folder)? {
            Found::Unfinished(unfinished) => *unfinished,
            Found::Done { reason } => {
                let text = format!("the run in {} is done: {reason}", folder.display());
                return Err(Fault::Results(text));
            }
        };
        if let Some(reason) = unfinished.so_far.stopped {
            return Err(Fault::Step(format!(
                "the run stopped itself, and cannot go on: {reason}"
            )));
        }
        let simulation = Simulation::new(&unfinished.scene, unfinished.mesh)
            .map_err(|error| Fault::Scene(error.to_string()))?;
        let simulation = simulation.resumed(&unfinished.run).map_err(|error| {
            Fault::Results(format!(
                "the last checkpoint cannot be used: {error} (go on with the version of cdem that \
                 wrote it; if this is the one, report a defect)"
            ))
        })?;
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
        })
    }

    fn record(&mut self, folder: &Path, scene: &Path, force: bool) -> Result<(), Fault> {
        if let Some(recording) = &self.recording {
            return Err(Fault::Results(format!(
                "the run writes to {} already; close it first",
                recording.folder().display()
            )));
        }
        self.recording = Some(self.begin(folder, scene, force)?);
        Ok(())
    }

    /// A new folder of results.
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

    fn advance(&mut self, leg: Leg) -> Result<bool, Fault> {
        if let Some(failed) = &self.failed {
            return Err(Fault::Step(failed.clone()));
        }
        let began = Instant::now();
        let advanced = self.steps(leg, began);
        self.wall += began.elapsed();
        match advanced {
            Ok(is_there) => {
                if self.simulation.finished() {
                    self.end(Status::Done, self.reason_of_end())?;
                }
                Ok(is_there)
            }
            Err(fault) => {
                if let Fault::Step(reason) | Fault::Results(reason) = &fault {
                    let reason = reason.clone();
                    self.stop(&reason, matches!(fault, Fault::Step(_)));
                }
                Err(fault)
            }
        }
    }

    /// Steps and records.
    fn steps(&mut self, leg: Leg, began: Instant) -> Result<bool, Fault> {
        // A whole number of steps misses a time by round-off.
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

    /// What a run that has stopped itself leaves behind. Its reason is on its way already, so
    /// that a disk that refuses adds nothing to it.
    fn stop(&mut self, reason: &str, is_kept: bool) {
        self.failed = Some(reason.to_owned());
        if is_kept && let Some(recording) = &mut self.recording {
            let _ = recording.keep(&self.simulation, self.wall, Some(reason.to_owned()));
        }
        let _ = self.end(Status::Stopped, reason.to_owned());
    }

    /// Ends the results, if any are written.
    fn end(&mut self, status: Status, reason: String) -> Result<(), Fault> {
        let Some(recording) = self.recording.take() else {
            return Ok(());
        };
        let end = End { status, reason };
        let summary = recording.summary(&mut self.simulation, self.wall, &end);
        Ok(recording.finish(&mut self.simulation, &summary)?)
    }

    fn close(&mut self) -> Result<(), Fault> {
        let Some(recording) = &mut self.recording else {
            return Ok(());
        };
        let wall = self.wall;
        recording.observe(&mut self.simulation, || wall)?;
        recording.keep(&self.simulation, wall, None)?;
        let reason = format!("interrupted at t = {} s", self.simulation.time());
        self.end(Status::Interrupted, reason)
    }

    fn save(&mut self, folder: Option<PathBuf>, scene: &Path, force: bool) -> Result<(), Fault> {
        let wall = self.wall;
        match (&mut self.recording, folder) {
            (Some(recording), None) => {
                recording.observe(&mut self.simulation, || wall)?;
                Ok(recording.keep(&self.simulation, wall, None)?)
            }
            // Nothing is observed: contacts that have ended stay in the checkpoint, and the
            // first rows are those of who goes on.
            (_, Some(folder)) => {
                let mut recording = self.begin(&folder, scene, force)?;
                Ok(recording.keep(&self.simulation, wall, None)?)
            }
            (None, None) => Err(Fault::Results(
                "the run writes no results that a checkpoint could go to; name a folder".to_owned(),
            )),
        }
    }

    fn set_load(&mut self, number: usize, kind: &str, value: &str) -> Result<(), Fault> {
        let unreadable = |error: serde_json::Error| Fault::Scene(format!("load: {error}"));
        let scene = as_input(self.simulation.scene());
        let mut input = serde_json::to_value(scene).map_err(unreadable)?;
        input["load"][number][kind] = serde_json::from_str(value).map_err(unreadable)?;
        let scene =
            from_value(input).map_err(|problems| Fault::from(SceneError::Unwritten(problems)))?;
        let new = &scene.load[number].kind;
        self.simulation.set_load(number, new);
        if let Some(recording) = &mut self.recording {
            recording.change_loads(&self.simulation)?;
        }
        Ok(())
    }

    fn reason_of_end(&self) -> String {
        match &self.simulation.scene().time.stop_when {
            Some(stop) if self.simulation.step_index() < self.simulation.step_count() => format!(
                "time.stop_when: the kinetic energy has stayed below the threshold for {} s",
                stop.during
            ),
            _ => "reached the end".to_owned(),
        }
    }
}

/// Results that were not closed end as those of an interrupted run, to go on from.
impl Drop for Driven {
    fn drop(&mut self) {
        // There is nobody to tell if the disk refuses.
        let _ = self.close();
    }
}
