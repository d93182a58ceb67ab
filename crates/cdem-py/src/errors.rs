//! Conversion of errors to Python exceptions.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use cdem_io::results::{Front, ResultsError as ResultsFault};
use cdem_io::scene::SceneError as SceneFault;
use cdem_io::setup::SetupError;
use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};

pyo3::import_exception!(cdem.errors, SceneError);
pyo3::import_exception!(cdem.errors, MeshError);
pyo3::import_exception!(cdem.errors, StepError);
pyo3::import_exception!(cdem.errors, ResultsError);

/// Python wording of the advice in error messages.
const PYTHON: Front = Front {
    naming: "",
    force: "force=True",
    run: "`record()` or `cdem run`",
    resume: "`Simulation.load(folder, record=True)`",
};

/// A fault before it becomes an exception, which needs the interpreter.
#[derive(Clone, Debug)]
pub(crate) enum Fault {
    /// In the scene.
    Scene(String),
    /// In a mesh.
    Mesh(String),
    /// In an argument.
    Value(String),
    /// The run has stopped itself.
    Step(String),
    /// In a results folder.
    Results(String),
    /// The system gives no more threads.
    Threads(String),
    /// A defect of the program.
    Defect(String),
}

impl From<SceneFault> for Fault {
    fn from(error: SceneFault) -> Self {
        Self::Scene(error.to_string())
    }
}

impl From<SetupError> for Fault {
    fn from(error: SetupError) -> Self {
        match error {
            SetupError::Mesh(blame) => Self::Mesh(blame.to_string()),
            other => Self::Scene(other.to_string()),
        }
    }
}

impl From<ResultsFault> for Fault {
    fn from(error: ResultsFault) -> Self {
        let text = format!("{error} ({})", error.help(&PYTHON));
        match error {
            ResultsFault::Stopped { .. } => Self::Step(text),
            _ => Self::Results(text),
        }
    }
}

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Scene(text) => SceneError::new_err(text),
            Fault::Mesh(text) => MeshError::new_err(text),
            Fault::Value(text) => PyValueError::new_err(text),
            Fault::Step(text) => StepError::new_err(text),
            Fault::Results(text) => ResultsError::new_err(text),
            Fault::Threads(text) | Fault::Defect(text) => PyRuntimeError::new_err(text),
        }
    }
}

/// Does `work`; turns a panic into an error that asks for a report.
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let said = said(&*panic);
        let text = format!("this is a defect of cdem; please report it with the scene: {said}");
        Err(Fault::Defect(text))
    })
}

fn said(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("without a reason")
}
