//! Tests of meshes from scene to blocks.

pub(crate) mod assembly;
pub(crate) mod overlap;
pub(crate) mod shapes;

use std::path::{Path, PathBuf};

use crate::mesh::{Element, Mesh, MeshError, RawMesh, assemble, quality};
use crate::scene::*;

/// Returns a scene of the given blocks; meshes do not depend on the rest of it.
pub(crate) fn scene(dimension: usize, block: Vec<Block>) -> Scene {
    Scene {
        version: 1,
        title: String::new(),
        dimension,
        plane: Plane::Strain,
        thickness: 1.0,
        gravity: Schedule::Constant(vec![0.0; dimension]),
        time: Time {
            end: 1.0,
            step: None,
            safety: 0.8,
            stop_when: None,
        },
        material: Vec::new(),
        block,
        boundary: Vec::new(),
        load: Vec::new(),
        contact: Contact {
            model: ContactModel::UnifiedNode,
            tolerance: None,
            strength: Strength::default(),
            energy_loss: 0.01,
            max_level: 5,
            zone: ZoneExtent::Graded,
            normal_stiffness: None,
            shear_stiffness: None,
            pair: Vec::new(),
        },
        output: Output {
            frames: Cadence::Count(1),
            history: Cadence::Count(1),
            blocks: Cadence::Count(1),
            block_list: None,
            fields: Vec::new(),
            checkpoint: 0.0,
        },
        probe: Vec::new(),
        warnings: Vec::new(),
    }
}

/// Returns a block of this geometry, without placement.
pub(crate) fn block(name: &str, geometry: Geometry) -> Block {
    Block {
        name: name.to_owned(),
        geometry,
        split: Split::None,
        material: "rock".to_owned(),
        velocity: vec![0.0; 3],
        angular_velocity: vec![0.0; 3],
        scale: 1.0,
        rotate: Rotation {
            axis: [0.0, 0.0, 1.0],
            angle: 0.0,
        },
        translate: vec![0.0; 3],
        kinematics: Kinematics::Total,
        mass: Mass::Auto,
        fixed: false,
    }
}

/// Returns the geometry of a mesh file, of which `group` is used.
fn file(path: &str, group: Option<&str>) -> Geometry {
    Geometry::Mesh {
        path: PathBuf::from(path),
        group: group.map(str::to_owned),
    }
}

/// Assembles blocks of shapes.
pub(crate) fn shapes<const D: usize>(blocks: Vec<Block>) -> Result<Mesh<D>, MeshError> {
    assemble(&scene(D, blocks), &mut |path: &Path| {
        panic!("no mesh file is asked for, but {}", path.display())
    })
}

/// Assembles blocks of one mesh file.
fn blocks_of<const D: usize>(raw: &RawMesh, blocks: Vec<Block>) -> Result<Mesh<D>, MeshError> {
    assemble(&scene(D, blocks), &mut |_: &Path| Ok(raw.clone()))
}

fn volume<const D: usize>(mesh: &Mesh<D>, element: &Element) -> f64 {
    let corners: Vec<_> = element
        .nodes()
        .iter()
        .map(|&n| mesh.nodes[n as usize])
        .collect();
    quality::volume(element.kind, &corners)
}

fn total_volume<const D: usize>(mesh: &Mesh<D>) -> f64 {
    mesh.elements
        .iter()
        .map(|element| volume(mesh, element))
        .sum()
}
