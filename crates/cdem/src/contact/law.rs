//! Strengths of contacts, by pair of blocks.

use crate::mesh::Mesh;
use crate::model::names::parts;
use crate::scene::{ContactPair, Scene};

/// What a contact between two blocks can bear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Law {
    /// `false`: the two ignore each other.
    pub(crate) enabled: bool,
    /// tan φ.
    pub(crate) friction: f64,
    /// Cohesion of joints, Pa.
    pub(crate) cohesion: f64,
    /// Tensile strength of joints, Pa.
    pub(crate) tensile_strength: f64,
    /// Penalty: normal stiffness, N/m.
    pub(crate) normal_stiffness: f64,
    /// Penalty: shear stiffness, N/m.
    pub(crate) shear_stiffness: f64,
}

/// The laws of all pairs of blocks.
#[derive(Clone, Debug)]
pub(crate) struct Laws {
    general: Law,
    /// Overrides in rising rank, each with the blocks on its two sides.
    overrides: Vec<(ContactPair, [Vec<bool>; 2])>,
}

impl Laws {
    /// The laws of a scene's blocks; see [`ContactPair`] for the rank of pairs.
    pub(crate) fn new<const D: usize>(scene: &Scene, mesh: &Mesh<D>) -> Self {
        let contact = &scene.contact;
        let general = Law {
            enabled: true,
            friction: contact.strength.friction_angle.tan(),
            cohesion: contact.strength.cohesion,
            tensile_strength: contact.strength.tensile_strength,
            normal_stiffness: contact.normal_stiffness.unwrap_or(0.0),
            shear_stiffness: contact.shear_stiffness.unwrap_or(0.0),
        };
        let of_block = |name: &str| {
            let mut meant = vec![false; mesh.blocks.len()];
            parts(scene, mesh, name).for_each(|block| meant[block] = true);
            meant
        };
        let of_material = |name: &str| {
            let blocks = mesh.blocks.iter();
            let meant = blocks.map(|block| scene.block[block.source].material == name);
            meant.collect::<Vec<_>>()
        };
        let (mut materials, mut blocks) = (Vec::new(), Vec::new());
        for pair in &contact.pair {
            let sides = pair.between.each_ref().map(|name| of_block(name));
            if sides.iter().all(|side| side.iter().any(|&hit| hit)) {
                blocks.push((pair.clone(), sides));
            } else {
                let sides = pair.between.each_ref().map(|name| of_material(name));
                materials.push((pair.clone(), sides));
            }
        }
        materials.extend(blocks);
        Self {
            general,
            overrides: materials,
        }
    }

    /// The law between two blocks.
    pub(crate) fn between(&self, a: u32, b: u32) -> Law {
        let (a, b) = (a as usize, b as usize);
        let mut law = self.general;
        for (pair, [one, other]) in &self.overrides {
            if !(one[a] && other[b] || one[b] && other[a]) {
                continue;
            }
            law.enabled = pair.enabled.unwrap_or(law.enabled);
            let set = |value: Option<f64>, field: &mut f64| *field = value.unwrap_or(*field);
            set(pair.friction_angle.map(f64::tan), &mut law.friction);
            set(pair.cohesion, &mut law.cohesion);
            set(pair.tensile_strength, &mut law.tensile_strength);
            set(pair.normal_stiffness, &mut law.normal_stiffness);
            set(pair.shear_stiffness, &mut law.shear_stiffness);
        }
        law
    }
}
