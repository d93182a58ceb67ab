//! Rows of a run as dictionaries and flat arrays.

use cdem::output::{BlockRow, ContactFrame, ContactRow, FieldValues, HistoryRow};
use cdem::scene::Field;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Fault;

/// Returns a history row by column; vectors are arrays of three.
pub(crate) fn history<'py>(py: Python<'py>, row: &HistoryRow) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("step", row.step)?;
    for (name, value) in [
        ("time", row.time),
        ("kinetic_energy", row.kinetic_energy),
        ("strain_energy", row.strain_energy),
        ("external_work", row.external_work),
        ("gravity_work", row.gravity_work),
        ("impact_loss", row.impact_loss),
        ("friction_loss", row.friction_loss),
        ("damping_loss", row.damping_loss),
        ("fracture_loss", row.fracture_loss),
        ("remesh_loss", row.remesh_loss),
        ("correction_loss", row.correction_loss),
        ("energy_residual", row.energy_residual),
    ] {
        out.set_item(name, value)?;
    }
    out.set_item("momentum", flat(py, [row.momentum]))?;
    out.set_item("angular_momentum", flat(py, [row.angular_momentum]))?;
    out.set_item("impulse", flat(py, [row.impulse]))?;
    out.set_item("contacts", row.contacts)?;
    out.set_item("refined_blocks", row.refined_blocks)?;
    out.set_item("elements", row.elements)?;
    Ok(out)
}

/// Returns block rows, column by column.
pub(crate) fn blocks<'py>(py: Python<'py>, rows: &[BlockRow]) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let of = |value: fn(&BlockRow) -> [f64; 3]| flat(py, rows.iter().map(value));
    let names: Vec<&str> = rows.iter().map(|row| row.block.as_str()).collect();
    out.set_item("block", names)?;
    let masses: Vec<f64> = rows.iter().map(|row| row.mass).collect();
    out.set_item("mass", masses.into_pyarray(py))?;
    out.set_item("position", of(|row| row.position))?;
    out.set_item("velocity", of(|row| row.velocity))?;
    out.set_item("angular_velocity", of(|row| row.angular_velocity))?;
    out.set_item("force", of(|row| row.force))?;
    Ok(out)
}

/// Returns contact rows, column by column.
pub(crate) fn contacts<'py>(py: Python<'py>, rows: &[ContactRow]) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let text = |value: fn(&ContactRow) -> &str| rows.iter().map(value).collect::<Vec<_>>();
    let real =
        |value: fn(&ContactRow) -> f64| rows.iter().map(value).collect::<Vec<_>>().into_pyarray(py);
    out.set_item("main", text(|row| &row.main))?;
    out.set_item("target", text(|row| &row.target))?;
    out.set_item("type", text(|row| row.kind.name()))?;
    out.set_item("time_on", real(|row| row.time_on))?;
    out.set_item("time_off", real(|row| row.time_off.unwrap_or(f64::NAN)))?;
    out.set_item("position", flat(py, rows.iter().map(|row| row.position)))?;
    out.set_item("peak_normal_force", real(|row| row.peak_normal_force))?;
    out.set_item("normal_impulse", real(|row| row.normal_impulse))?;
    out.set_item("shear_impulse", real(|row| row.shear_impulse))?;
    out.set_item("slip", real(|row| row.slip))?;
    let levels: Vec<i64> = rows.iter().map(|row| i64::from(row.level)).collect();
    out.set_item("level", levels.into_pyarray(py))?;
    Ok(out)
}

/// Adds positions, normals, forces and areas of the present contact points to their rows.
pub(crate) fn add_live(out: &Bound<'_, PyDict>, frame: ContactFrame) -> PyResult<()> {
    let py = out.py();
    out.set_item("point", flat(py, frame.points))?;
    out.set_item("normal", flat(py, frame.normals))?;
    out.set_item("force", flat(py, frame.forces))?;
    out.set_item("area", frame.areas.into_pyarray(py))
}

/// Returns a field as a flat array that takes over the engine's memory.
pub(crate) fn field(py: Python<'_>, values: FieldValues) -> Bound<'_, PyAny> {
    match values {
        FieldValues::Real(values) => values.into_pyarray(py).into_any(),
        FieldValues::Whole(values) => values.into_pyarray(py).into_any(),
    }
}

/// Returns vectors as a flat array.
pub(crate) fn flat(
    py: Python<'_>,
    vectors: impl IntoIterator<Item = [f64; 3]>,
) -> Bound<'_, PyArray1<f64>> {
    let vectors: Vec<[f64; 3]> = vectors.into_iter().collect();
    vectors.into_flattened().into_pyarray(py)
}

/// Returns the field with this name in scenes.
pub(crate) fn field_of(name: &str) -> Result<Field, Fault> {
    serde_json::from_value(name.into()).map_err(|error: serde_json::Error| {
        Fault::Value(format!("there is no such field: {error}"))
    })
}
