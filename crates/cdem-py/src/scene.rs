//! Scenes from Python.

use std::path::PathBuf;

use cdem_io::scene::{self, SceneError, SceneFile};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::{Fault, guarded};

/// Contents of a scene: the text of a file, or the keys of a dictionary.
#[pyclass(frozen, module = "cdem._engine")]
pub(crate) struct Source {
    /// TOML or JSON.
    text: String,
    is_file: bool,
    /// The scene file, or the folder to which mesh paths are relative.
    path: PathBuf,
}

#[pymethods]
impl Source {
    #[new]
    fn new(text: String, is_file: bool, path: PathBuf) -> Self {
        Self {
            text,
            is_file,
            path,
        }
    }
}

impl Source {
    /// Reads and checks the scene.
    pub(crate) fn read(&self) -> Result<SceneFile, Fault> {
        if self.is_file {
            return Ok(scene::parse(&self.text, &self.path)?);
        }
        let value = serde_json::from_str(&self.text)
            .map_err(|error| Fault::Scene(format!("the scene cannot be read: {error}")))?;
        Ok(scene::check(value, &self.path)?)
    }
}

/// The JSON Schema of a scene, as text.
#[pyfunction]
pub(crate) fn schema() -> String {
    cdem::scene::json_schema().to_string()
}

/// Seconds from text with a unit.
#[pyfunction]
pub(crate) fn seconds(text: &str) -> PyResult<f64> {
    let read = cdem::scene::time(text.into()).map_err(SceneError::Unwritten);
    read.map_err(|error| PyValueError::new_err(error.to_string()))
}

/// A scene as TOML, checked, with all defaults filled in.
#[pyfunction]
pub(crate) fn written(source: &Source) -> PyResult<String> {
    Ok(guarded(|| Ok(scene::write(&source.read()?.scene)))?)
}
