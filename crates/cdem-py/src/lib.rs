//! The engine behind the package `cdem` for Python.
//!
//! A thin layer that passes plain numbers, text and flat arrays. The names and documentation for
//! users are written in Python, in `python/cdem/`.

mod driven;
mod errors;
mod mesh;
mod pool;
mod run;
mod scene;
mod tables;

use pyo3::prelude::*;

/// The engine of the package `cdem`; not for direct use.
#[pymodule]
mod _engine {
    #[pymodule_export]
    use super::mesh::Mesh;
    #[pymodule_export]
    use super::run::Run;
    #[pymodule_export]
    use super::scene::{Source, schema, seconds, written};
}
