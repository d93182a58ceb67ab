//! Collisions between deformable blocks: explicit finite elements inside the blocks, and contact
//! without springs between them.
//!
//! Data flows one way: [`scene`] → [`mesh`] → model → step loop → rows and frames ([`output`]).
//! The crate knows neither files nor terminals; `cdem-io` and `cdem-cli` do.
//!
//! # Example
//!
//! A block of 1 m falls on a fixed floor for 0.1 s:
//!
//! ```
//! use cdem::{AnyMesh, Simulation, mesh::assemble, scene::from_value};
//!
//! let cube = |bottom: f64| serde_json::json!({
//!     "box": { "min": [0.0, bottom], "max": [1.0, bottom + 1.0], "divisions": [1, 1] }
//! });
//! let scene = from_value(serde_json::json!({
//!     "version": 1,
//!     "dimension": 2,
//!     "gravity": [0.0, -9.81],
//!     "time": { "end": 0.1 },
//!     "material": [{
//!         "name": "soft", "young_modulus": "1 MPa", "poisson_ratio": 0.2, "density": 1000.0
//!     }],
//!     "block": [
//!         { "name": "floor", "material": "soft", "fixed": true, "element": "quad4", "shape": cube(-1.0) },
//!         { "name": "stone", "material": "soft", "element": "quad4", "shape": cube(0.02) }
//!     ]
//! }))
//! .expect("the keys are right");
//! let mesh = assemble::<2>(&scene, &mut |_| unreachable!("a shape needs no mesh file"))?;
//! let mut simulation = Simulation::new(&scene, AnyMesh::Plane(mesh))?;
//! while !simulation.finished() {
//!     simulation.step()?;
//! }
//! assert!(simulation.contacts_begun() > 0);
//! let energies = simulation.history();
//! assert!(energies.energy_residual.abs() < 0.02 * simulation.energy_exchanged());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod contact;
mod element;
mod math;
pub mod mesh;
mod model;
mod refinement;
pub mod scene;
mod simulation;
mod step;

pub use crate::element::mass::{MassError, MassFault, MassKind};
pub use crate::math::format::{quantity, significant};
pub use crate::math::profile::Stage;
pub use crate::math::restore::ResumeError;
pub use crate::model::ModelError;
pub use crate::model::state::Corrections;
pub use crate::simulation::edit::BlockRange;
pub use crate::simulation::output;
pub use crate::simulation::snapshot::Snapshot;
pub use crate::simulation::update_cost::UpdateCost;
pub use crate::simulation::validity::StepError;
pub use crate::simulation::{AnyMesh, BlockOverview, CollisionOverview, Overview, Simulation};
