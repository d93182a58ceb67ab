//! Collisions between deformable blocks: explicit finite elements inside the
//! blocks, spring-free contact between them.
//!
//! Data flows one way: [`scene`] → [`mesh`] → model → step loop → [`sample`]s.
//! The crate knows neither files nor terminals; `cdem-io` and `cdem-cli` do.

mod around;
mod between;
mod capture;
mod checkpoint;
mod contact;
mod cost;
mod element;
mod health;
mod mass;
mod material;
pub mod mesh;
mod model;
mod number;
mod profile;
mod raw;
mod refinement;
mod report;
mod rest;
pub mod sample;
pub mod scene;
mod simulation;
mod space;
mod step;
mod vector;

pub use between::BlockRange;
pub use capture::Capture;
pub use checkpoint::ResumeError;
pub use cost::UpdateCost;
pub use health::StepError;
pub use mass::{MassError, MassFault, MassKind};
pub use model::ModelError;
pub use number::{quantity, significant};
pub use profile::Stage;
pub use simulation::{AnyMesh, BlockOverview, CollisionOverview, Overview, Simulation};
pub use step::Corrections;
