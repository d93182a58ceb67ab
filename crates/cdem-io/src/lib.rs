//! Files of `cdem`: scenes, Gmsh meshes, result folders.

pub mod gmsh;
pub mod results;
pub mod scene;
