//! Collisions between deformable blocks: explicit finite elements inside the
//! blocks, spring-free contact between them.
//!
//! Data flows one way: [`scene`] → [`mesh`] → model → step loop → [`sample`]s.
//! The crate knows neither files nor terminals; `cdem-io` and `cdem-cli` do.

pub mod element;
pub mod mass;
pub mod material;
pub mod mesh;
pub mod sample;
pub mod scene;
