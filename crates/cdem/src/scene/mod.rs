//! The scene: the user's description of a run, in SI units.
//!
//! A tree of values, from a file or from a program, becomes a [`Scene`] in two steps. First it is
//! read as the input types, whose fields are the keys of the scene file; this finds unknown keys,
//! wrong types and wrong units. Then the keys are checked against each other, and defaults are
//! filled in. Each step reports all errors, by [`KeyPath`]; see [`from_value`].

pub(crate) mod check;
pub(crate) mod decode;
pub(crate) mod element_kind;
pub(crate) mod export;
pub(crate) mod input;
pub(crate) mod key_path;
pub(crate) mod problem;
pub(crate) mod schedule;
pub(crate) mod schema;
pub(crate) mod types;

pub use crate::scene::export::as_input;
pub use crate::scene::key_path::{KeyPath, Step};
pub(crate) use crate::scene::problem::suggestion;
pub use crate::scene::problem::{Help, Place, Problem};
pub use crate::scene::schedule::{Linear, Schedule};
pub use crate::scene::schema::json_schema;
pub(crate) use crate::scene::types::is_part;
pub use crate::scene::types::{
    Block, Boundary, BoundaryTarget, Cadence, Contact, ContactModel, ContactPair, Damping, Field,
    Geometry, Kinematics, Load, LoadKind, Mass, Material, MaterialModel, Motion, Output, Plane,
    Probe, Rotation, Scene, Split, StopWhen, Strength, Time, ZoneExtent,
};

/// Reads and checks a scene from a tree of values, as a TOML or JSON file or a dictionary gives it:
/// the keys of the scene file, numbers in SI units or text with a unit, angles in degrees. `null`
/// means that a key is left out.
///
/// # Errors
/// All errors in keys and types; if there are none, all errors in values.
pub fn from_value(value: serde_json::Value) -> Result<Scene, Vec<Problem>> {
    if let Some(version) = value.get("version").filter(|version| version.is_number())
        && version.as_f64() != Some(f64::from(check::VERSION))
    {
        let path = KeyPath::root().key("version");
        let problem = Problem::new(path, format!("must be {}, got {version}", check::VERSION));
        let help = "this program reads version 1 only; a newer scene needs a newer program";
        return Err(vec![problem.help(help)]);
    }
    check::check(&decode::decode(value)?)
}

/// Reads a time, s, as keys of a scene accept it: a number in seconds, or text with a unit.
///
/// # Errors
/// If the value is not a time.
pub fn time(value: serde_json::Value) -> Result<f64, Vec<Problem>> {
    decode::decode(value).map(input::Quantity::<input::Duration>::si)
}
