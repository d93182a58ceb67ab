//! Collisions between deformable blocks: explicit finite elements inside the blocks, spring-free
//! contact between them.
//!
//! Data flows one way: [`scene`] → [`mesh`] → model → step loop → rows and frames ([`output`]). The
//! crate handles neither files nor terminals; `cdem-io` and `cdem-cli` do.

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
pub use crate::simulation::edit::BlockRange;
pub use crate::simulation::output;
pub use crate::simulation::snapshot::Snapshot;
pub use crate::simulation::update_cost::UpdateCost;
pub use crate::simulation::validity::StepError;
pub use crate::simulation::{AnyMesh, BlockOverview, CollisionOverview, Overview, Simulation};
pub use crate::step::Corrections;
