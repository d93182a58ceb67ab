//! Sets up a run from a scene; errors are shown at their key of the scene.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cdem::mesh::{BlockFault, Mesh, MeshError, RawMesh, assemble};
use cdem::scene::{Geometry, KeyPath, Problem};
use cdem::{AnyMesh, ModelError, Simulation};
use thiserror::Error;

use crate::gmsh;
use crate::scene::{SceneError, SceneFile};

/// A simulation at its start, with warnings.
pub struct Built {
    /// The simulation.
    pub simulation: Simulation,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
}

/// Error in the setup of a valid scene.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SetupError {
    /// A mesh has an error.
    #[error("{0}")]
    Mesh(Blame),
    /// Scene and meshes do not fit together.
    #[error("{0}")]
    Model(Blame),
}

/// An error with its place.
#[derive(Debug, Error)]
pub enum Blame {
    /// At a key of the scene.
    #[error("{0}")]
    Scene(SceneError),
    /// Without a key.
    #[error("{0}")]
    None(String),
}

impl SetupError {
    /// Returns the error with its place.
    #[must_use]
    pub fn into_blame(self) -> Blame {
        match self {
            Self::Mesh(blame) | Self::Model(blame) => blame,
        }
    }
}

/// Reads the meshes of a scene and builds its model. Meshes in `at_hand`, keyed by their path in
/// the scene, are not read from files.
///
/// # Errors
/// The first mesh with an error, or the first mismatch of mesh and scene.
pub fn build(
    file: &SceneFile,
    at_hand: &mut BTreeMap<PathBuf, RawMesh>,
) -> Result<Built, SetupError> {
    let (mesh, mut warnings) = match file.scene.dimension {
        2 => {
            let mesh = read_meshes::<2>(file, at_hand)?;
            (AnyMesh::Plane(mesh.0), mesh.1)
        }
        _ => {
            let mesh = read_meshes::<3>(file, at_hand)?;
            (AnyMesh::Solid(mesh.0), mesh.1)
        }
    };
    let simulation = Simulation::new(&file.scene, mesh)
        .map_err(|error| SetupError::Model(blame_for_model(file, &error)))?;
    let cautions = simulation.overview().warnings;
    warnings.extend(cautions.iter().map(|caution| file.warning(caution)));
    Ok(Built {
        simulation,
        warnings,
    })
}

fn read_meshes<const D: usize>(
    file: &SceneFile,
    at_hand: &mut BTreeMap<PathBuf, RawMesh>,
) -> Result<(Mesh<D>, Vec<String>), SetupError> {
    let mut load = |path: &Path| match at_hand.remove(path) {
        Some(mesh) => Ok(mesh),
        None => gmsh::read(&file.directory().join(path)),
    };
    let mesh = assemble::<D>(&file.scene, &mut load)
        .map_err(|error| SetupError::Mesh(blame_for_mesh(file, &error)))?;
    let notes = mesh.notes.clone();
    Ok((mesh, notes))
}

/// Returns the error at its block of the scene; for a file, at the first block made from it.
fn blame_for_mesh(file: &SceneFile, error: &MeshError) -> Blame {
    let blocks = || file.scene.block.iter().enumerate();
    let made_from = |mesh: &Path| {
        blocks().find(|(_, block)| {
            matches!(&block.geometry, Geometry::Mesh { path, .. }
                if file.directory().join(path) == mesh || path == mesh)
        })
    };
    let block = match error {
        MeshError::Block { block: name, .. } => blocks().find(|(_, block)| block.name == *name),
        MeshError::Unreadable { path, .. } => made_from(path),
        MeshError::Format { mesh, .. } | MeshError::Inconsistent { mesh, .. } => {
            made_from(Path::new(mesh))
        }
        _ => None,
    };
    let Some((index, block)) = block else {
        return Blame::None(error.to_string());
    };
    let whole = match block.geometry {
        Geometry::Mesh { .. } => "mesh",
        _ => "shape",
    };
    let (key, message) = match error {
        MeshError::Block { fault, .. } => match &**fault {
            // The path already names the key.
            BlockFault::Shape { key, problem } => (*key, problem.clone()),
            fault => (fault.key().unwrap_or(whole), error.to_string()),
        },
        _ => (whole, error.to_string()),
    };
    let path = key_path(&format!("block[{index}].{key}"));
    Blame::Scene(file.error(vec![Problem::new(path, message)]))
}

/// Returns the error at its key of the scene.
fn blame_for_model(file: &SceneFile, error: &ModelError) -> Blame {
    match (error, error.key()) {
        (ModelError::UnknownBlocks(problems), _) => Blame::Scene(file.error(problems.clone())),
        (_, Some(key)) => {
            let problem = Problem::new(key_path(key), error.to_string());
            Blame::Scene(file.error(vec![problem]))
        }
        (_, None) => Blame::None(error.to_string()),
    }
}

/// Parses a path such as `boundary[0].group`.
fn key_path(text: &str) -> KeyPath {
    text.split(['.', '['])
        .fold(KeyPath::root(), |path, step| match step.strip_suffix(']') {
            Some(index) => path.index(index.parse().unwrap_or_default()),
            None => path.key(step),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn key_paths_are_read_as_they_are_written() {
        for text in [
            "contact",
            "boundary[0].group",
            "time.step",
            "block[12].mass",
        ] {
            assert_eq!(key_path(text).to_string(), text);
        }
    }
}
