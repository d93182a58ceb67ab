//! Block names in a scene, and the parts of the mesh that they refer to. Only the mesh knows the
//! number of parts of a split block.

use crate::mesh::Mesh;
use crate::model::ModelError;
use crate::scene::{BoundaryTarget, KeyPath, Problem, Scene, is_part, suggestion};

/// Returns the blocks of the mesh that `name` refers to: the block of that name, or all parts of
/// the scene's block of that name.
pub(crate) fn parts<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    name: &str,
) -> impl Iterator<Item = usize> + Clone {
    let blocks = mesh.blocks.iter().enumerate();
    blocks
        .filter(move |(_, block)| block.name == name || scene.block[block.source].name == name)
        .map(|(number, _)| number)
}

/// Returns an error for block names that refer to no part of the mesh.
pub(crate) fn refuse_unknown<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
) -> Result<(), ModelError> {
    let unknown = |name: &str| parts(scene, mesh, name).next().is_none();
    let wrong = references(scene)
        .into_iter()
        .filter(|(_, name)| unknown(name));
    let problems: Vec<_> = wrong
        .map(|(path, name)| problem(scene, mesh, path, name))
        .collect();
    if problems.is_empty() {
        Ok(())
    } else {
        Err(ModelError::UnknownBlocks(problems))
    }
}

/// Returns all block names in a scene, with their keys.
fn references(scene: &Scene) -> Vec<(KeyPath, &str)> {
    let root = KeyPath::root();
    let mut found = Vec::new();
    for (i, boundary) in scene.boundary.iter().enumerate() {
        if let BoundaryTarget::Block(name) = &boundary.target {
            found.push((root.key("boundary").index(i).key("block"), name.as_str()));
        }
    }
    let material = |name: &String| scene.material.iter().any(|m| m.name == *name);
    for (i, pair) in scene.contact.pair.iter().enumerate() {
        let at = root.key("contact").key("pair").index(i).key("between");
        if !pair.between.iter().all(material) {
            let names = pair.between.iter().enumerate();
            found.extend(names.map(|(side, name)| (at.index(side), name.as_str())));
        }
    }
    for (i, name) in scene.output.block_list.iter().flatten().enumerate() {
        found.push((root.key("output").key("block_list").index(i), name));
    }
    for (i, probe) in scene.probe.iter().enumerate() {
        found.push((root.key("probe").index(i).key("block"), &probe.block));
    }
    found
}

fn problem<const D: usize>(scene: &Scene, mesh: &Mesh<D>, path: KeyPath, name: &str) -> Problem {
    let whole = scene.block.iter().find(|block| is_part(&block.name, name));
    let of = whole.map(|whole| (whole, parts(scene, mesh, &whole.name).count()));
    match of {
        Some((whole, count @ 1..)) => {
            let whole = &whole.name;
            let message = format!("block \"{whole}\" has no part \"{name}\"");
            Problem::new(path, message).help(match count {
                1 => format!("the only part is `{whole}.1`"),
                _ => format!(
                    "did you mean `{whole}.{count}`? The parts are {whole}.1 to {whole}.{count}"
                ),
            })
        }
        _ => {
            let known = scene.block.iter().map(|block| block.name.as_str());
            let message = format!("no block is named \"{name}\"");
            Problem::new(path, message).help(suggestion(name, known))
        }
    }
}
