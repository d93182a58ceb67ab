//! From the file of a scene to a run at its start.

use std::path::Path;

use cdem::mesh::{BlockFault, Mesh, MeshError, assemble};
use cdem::scene::{Geometry, KeyPath, Problem};
use cdem::{AnyMesh, ModelError, Simulation};
use cdem_io::gmsh;
use cdem_io::scene::SceneFile;

use crate::failure::{Failure, Message};

/// A run at its start, and what the user should know.
pub(crate) struct Built {
    pub(crate) simulation: Simulation,
    pub(crate) warnings: Vec<String>,
}

/// Reads and checks a scene.
pub(crate) fn read(scene: &Path) -> Result<SceneFile, Failure> {
    cdem_io::scene::read(scene).map_err(Failure::wrong)
}

/// Reads the meshes of a scene and builds its model.
pub(crate) fn build(file: &SceneFile) -> Result<Built, Failure> {
    let (mesh, mut warnings) = match file.scene.dimension {
        2 => {
            let mesh = read_meshes::<2>(file)?;
            (AnyMesh::Plane(mesh.0), mesh.1)
        }
        _ => {
            let mesh = read_meshes::<3>(file)?;
            (AnyMesh::Solid(mesh.0), mesh.1)
        }
    };
    let simulation =
        Simulation::new(&file.scene, mesh).map_err(|error| model_failure(file, &error))?;
    let cautions = simulation.overview().warnings;
    warnings.extend(cautions.iter().map(|caution| file.warning(caution)));
    Ok(Built {
        simulation,
        warnings,
    })
}

fn read_meshes<const D: usize>(file: &SceneFile) -> Result<(Mesh<D>, Vec<String>), Failure> {
    let mut load = |path: &Path| gmsh::read(&file.directory().join(path));
    let mesh = assemble::<D>(&file.scene, &mut load).map_err(|error| mesh_failure(file, &error))?;
    let notes = mesh.notes.clone();
    Ok((mesh, notes))
}

/// The error at the block of the scene that it belongs to; of a file, the first
/// that is made from it.
fn mesh_failure(file: &SceneFile, error: &MeshError) -> Failure {
    let blocks = || file.scene.block.iter().enumerate();
    let made_from = |mesh: &Path| {
        blocks().find(|(_, block)| {
            matches!(&block.geometry, Geometry::Mesh { path, .. }
                if file.directory().join(path) == mesh)
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
        return Failure::wrong(Message::new(error, ""));
    };
    let whole = match block.geometry {
        Geometry::Mesh { .. } => "mesh",
        _ => "shape",
    };
    let (key, message) = match error {
        MeshError::Block { fault, .. } => match &**fault {
            // The path says which key.
            BlockFault::Shape { key, problem } => (*key, problem.clone()),
            fault => (fault.key().unwrap_or(whole), error.to_string()),
        },
        _ => (whole, error.to_string()),
    };
    let path = key_path(&format!("block[{index}].{key}"));
    Failure::wrong(file.error(vec![Problem::new(path, message)]))
}

/// The error at the key of the scene that it blames.
fn model_failure(file: &SceneFile, error: &ModelError) -> Failure {
    match (error, error.key()) {
        (ModelError::UnknownBlocks(problems), _) => Failure::wrong(file.error(problems.clone())),
        (_, Some(key)) => {
            let problem = Problem::new(key_path(key), error.to_string());
            Failure::wrong(file.error(vec![problem]))
        }
        (_, None) => Failure::wrong(Message::new(error, "")),
    }
}

/// The path that is written as `boundary[0].group`.
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
