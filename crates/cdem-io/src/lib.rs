//! Files of `cdem`: scenes, Gmsh meshes, result folders.
