//! A run, step by step.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use cdem_io::setup;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::sync::MutexExt as _;
use pyo3::types::PyDict;

use crate::driven::{Driven, Leg};
use crate::errors::{Fault, guarded};
use crate::mesh::{self, Mesh};
use crate::pool::pool;
use crate::scene::Source;
use crate::tables;

/// A simulation, and its results if it writes any.
#[pyclass(frozen, module = "cdem._engine")]
pub(crate) struct Run {
    driven: Mutex<Driven>,
    /// Number of threads; 0 means one per processor.
    threads: usize,
}

#[pymethods]
impl Run {
    /// A run at t = 0. `meshes` are meshes from arrays, by their paths in the scene.
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
        let driven = Driven::new(built.simulation, built.warnings, began);
        Ok(Self {
            driven: Mutex::new(driven),
            threads,
        })
    }

    /// The run in a results folder, at its last checkpoint. If `is_recorded`, results continue in
    /// that folder.
    #[staticmethod]
    fn load(py: Python<'_>, folder: PathBuf, is_recorded: bool, threads: usize) -> PyResult<Self> {
        let began = Instant::now();
        let driven = on_pool(py, threads, || Driven::load(folder, is_recorded, began))?;
        Ok(Self {
            driven: Mutex::new(driven),
            threads,
        })
    }

    /// Begins to write results to a folder. Paths of meshes are relative to the file `scene`.
    fn record(&self, py: Python<'_>, folder: PathBuf, scene: PathBuf, force: bool) -> PyResult<()> {
        self.work(py, |driven| driven.record(&folder, &scene, force))
    }

    /// Steps up to a time, s, the end, a number of steps, or a number of wall-clock seconds.
    /// Returns true if that time or the end is reached, and the number of steps.
    fn advance(
        &self,
        py: Python<'_>,
        until: f64,
        steps: u64,
        seconds: f64,
    ) -> PyResult<(bool, u64)> {
        let leg = Leg {
            until,
            steps,
            seconds,
        };
        self.work(py, |driven| driven.advance(leg))
    }

    /// Ends the results, with a checkpoint.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.work(py, Driven::close)
    }

    /// Writes a checkpoint to the results folder, or to a new folder.
    fn save(
        &self,
        py: Python<'_>,
        folder: Option<PathBuf>,
        scene: PathBuf,
        force: bool,
    ) -> PyResult<()> {
        self.work(py, |driven| driven.save(folder, &scene, force))
    }

    /// Results folder; None if no results are written.
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

    /// Dimension of the scene: 2 or 3.
    #[getter]
    fn dimension(&self, py: Python<'_>) -> usize {
        self.locked(py).simulation.scene().dimension
    }

    /// Number of coarse steps so far.
    #[getter]
    fn step_index(&self, py: Python<'_>) -> u64 {
        self.locked(py).simulation.step_index()
    }

    /// Length of the coarse step, s.
    #[getter]
    fn step_size(&self, py: Python<'_>) -> f64 {
        self.locked(py).simulation.overview().step
    }

    /// True if the end is reached.
    #[getter]
    fn finished(&self, py: Python<'_>) -> bool {
        self.locked(py).simulation.finished()
    }

    /// The scene as TOML, with all defaults filled in and all changes of loads.
    #[getter]
    fn scene(&self, py: Python<'_>) -> String {
        cdem_io::scene::write(self.locked(py).simulation.scene())
    }

    /// Warnings for the user.
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

    /// All blocks now, with their ranges in the arrays.
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

    /// Contacts that have ended since the last call. A run with results writes them to its
    /// folder instead.
    fn ended_contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rows = self.work(py, |driven| match &driven.recording {
            None => Ok(driven.simulation.ended_contacts()),
            Some(recording) => Err(Fault::Results(format!(
                "ended contacts are written to contacts.csv in {}; read them there",
                recording.folder().display()
            ))),
        })?;
        tables::contacts(py, &rows)
    }

    /// Positions of all points, flat, m.
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let positions = self.work(py, |driven| Ok(driven.simulation.positions()))?;
        Ok(tables::flat(py, positions).into_any())
    }

    /// A field of points or cells, flat, and its number of components.
    fn field<'py>(&self, py: Python<'py>, name: &str) -> PyResult<(Bound<'py, PyAny>, usize)> {
        let wanted = tables::field_of(name)?;
        let field = self.work(py, |driven| Ok(driven.simulation.field(wanted)))?;
        let components = field.components.len().max(1);
        Ok((tables::field(py, field.values), components))
    }

    /// Shapes of all cells, and the points of all cells in one array.
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<(Vec<&'static str>, Bound<'py, PyAny>)> {
        let (kinds, points) = self.work(py, |driven| Ok(driven.simulation.cells()))?;
        let kinds = kinds.into_iter().map(mesh::name_of).collect();
        let points = numpy::IntoPyArray::into_pyarray(points, py);
        Ok((kinds, points.into_any()))
    }

    /// Sets the velocities, m/s, of the points of a block, or of all points. `values` are flat,
    /// with `components` each.
    fn set_velocities(
        &self,
        py: Python<'_>,
        block: Option<String>,
        values: PyReadonlyArray1<'_, f64>,
        components: usize,
    ) -> PyResult<()> {
        let values = values.as_slice()?.to_vec();
        self.work(py, |driven| {
            driven.set_velocities(block.as_deref(), &values, components)
        })
    }

    /// Changes a load from now on. `kind` is "pressure" or "traction"; `value` is JSON.
    fn set_load(&self, py: Python<'_>, number: usize, kind: &str, value: &str) -> PyResult<()> {
        self.work(py, |driven| driven.set_load(number, kind, value))
    }
}

impl Run {
    /// Locks the run; other Python threads continue while this one waits. A poisoned lock is
    /// accepted, because the panic has already been reported.
    fn locked(&self, py: Python<'_>) -> MutexGuard<'_, Driven> {
        let locked = self.driven.lock_py_attached(py);
        locked.unwrap_or_else(PoisonError::into_inner)
    }

    /// Does `work` on the threads of the run while other Python threads continue.
    fn work<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Driven) -> Result<T, Fault> + Send,
    ) -> PyResult<T> {
        // Lock before entering the pool. A pool thread that waits for its part of a step could
        // otherwise take up other work and wait for itself.
        let done = py.detach(|| {
            let locked = self.driven.lock();
            let mut locked = locked.unwrap_or_else(PoisonError::into_inner);
            locked.work(self.threads, work)
        });
        Ok(done?)
    }
}

/// Results that were not closed end like those of an interrupted run and can be resumed.
impl Drop for Run {
    fn drop(&mut self) {
        let threads = self.threads;
        let driven = self.driven.get_mut();
        let driven = driven.unwrap_or_else(PoisonError::into_inner);
        if driven.recording.is_some() {
            // An error of the disk cannot be reported here.
            Python::try_attach(|py| py.detach(|| driven.work(threads, Driven::close)).ok());
        }
    }
}

/// Does `work` on `threads` threads while other Python threads continue.
fn on_pool<T: Send>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce() -> Result<T, Fault> + Send,
) -> PyResult<T> {
    Ok(py.detach(|| pool(threads)?.install(|| guarded(work)))?)
}
