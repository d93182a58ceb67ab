//! Files of `cdem`: scenes, Gmsh meshes, results folders.

pub mod gmsh;
pub mod report;
pub mod results;
pub mod scene;
pub mod setup;
