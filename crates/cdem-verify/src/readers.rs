//! Readers given arbitrary bytes: fuzz targets, and the replay of inputs they have found.
//!
//! For any bytes, a reader returns a value or an error. Each function panics only if the value is
//! wrong.

use std::path::Path;

use cdem::mesh::assemble;
use cdem::scene::Scene;
use cdem::{AnyMesh, Simulation};

use crate::load;

/// Reads bytes as a scene. A scene that can be read must be the same after writing and reading.
///
/// # Panics
/// If it is not the same, or a message is empty.
pub fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let path = Path::new("scene.toml");
    match cdem_io::scene::parse(text, path) {
        Ok(file) => {
            let written = cdem_io::scene::write(&file.scene);
            let again = cdem_io::scene::parse(&written, path);
            let again = again.unwrap_or_else(|error| panic!("{}", error.render(false)));
            // Keys without effect are not written.
            let read = Scene {
                warnings: Vec::new(),
                ..file.scene
            };
            assert_eq!(again.scene, read);
        }
        Err(error) => assert!(!error.render(false).is_empty()),
    }
}

/// Reads bytes as a mesh and cuts it into blocks, in 2-D and 3-D.
///
/// # Panics
/// If a message is empty.
pub fn mesh(bytes: &[u8]) {
    let mesh = match cdem_io::gmsh::parse("any.msh", bytes) {
        Ok(mesh) => mesh,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    let mut read = |_: &Path| Ok(mesh.clone());
    for name in ["shot", "shot-3d"] {
        let mut case = load(name);
        for block in &mut case.scene.block {
            block.geometry = cdem::scene::Geometry::Mesh {
                path: "any.msh".into(),
                group: None,
            };
            block.split = cdem::scene::Split::Components;
        }
        let made = if case.scene.dimension == 2 {
            assemble(&case.scene, &mut read).map(AnyMesh::Plane)
        } else {
            assemble(&case.scene, &mut read).map(AnyMesh::Solid)
        };
        match made {
            Ok(mesh) => drop(mesh),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

/// Reads bytes as the initial mesh in a checkpoint.
///
/// # Panics
/// If a message is empty.
pub fn start(bytes: &[u8]) {
    let Ok(mesh) = postcard::from_bytes::<AnyMesh>(bytes) else {
        return;
    };
    let name = match &mesh {
        AnyMesh::Plane(_) => "shot",
        AnyMesh::Solid(_) => "shot-3d",
    };
    if let Err(error) = Simulation::new(&load(name).scene, mesh) {
        assert!(!error.to_string().is_empty());
    }
}

/// Creates the run that [`checkpoint`] resumes.
#[must_use]
pub fn run() -> Simulation {
    load("two-scale-prisms").start()
}

/// Reads bytes as the state of a run in the middle of an impact.
pub fn checkpoint(bytes: &[u8]) {
    drop(run().resumed(bytes));
}
