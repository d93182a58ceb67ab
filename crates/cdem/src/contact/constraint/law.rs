//! Contact laws by pair of blocks: strengths and penalty stiffnesses.

use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;
use crate::model::block_names::parts;
use crate::scene::{ContactPair, Scene};

/// Strengths and penalty stiffnesses of contacts between two blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContactLaw {
    /// If `false`, the two blocks ignore each other.
    pub(crate) enabled: bool,
    /// tan φ.
    pub(crate) friction: f64,
    /// Cohesion of joints, Pa.
    pub(crate) cohesion: f64,
    /// Tensile strength of joints, Pa.
    pub(crate) tensile_strength: f64,
    /// Penalty model: normal stiffness, N/m.
    pub(crate) normal_stiffness: f64,
    /// Penalty model: shear stiffness, N/m.
    pub(crate) shear_stiffness: f64,
}

/// Values of the law that one pair of the scene overrides.
#[derive(Clone, Copy, Debug)]
struct PairOverride {
    enabled: Option<bool>,
    friction: Option<f64>,
    cohesion: Option<f64>,
    tensile_strength: Option<f64>,
    normal_stiffness: Option<f64>,
    shear_stiffness: Option<f64>,
}

impl PairOverride {
    fn new(pair: &ContactPair) -> Self {
        Self {
            enabled: pair.enabled,
            friction: pair.friction_angle.map(f64::tan),
            cohesion: pair.cohesion,
            tensile_strength: pair.tensile_strength,
            normal_stiffness: pair.normal_stiffness,
            shear_stiffness: pair.shear_stiffness,
        }
    }

    fn apply(&self, law: &mut ContactLaw) {
        law.enabled = self.enabled.unwrap_or(law.enabled);
        let set = |value: Option<f64>, field: &mut f64| *field = value.unwrap_or(*field);
        set(self.friction, &mut law.friction);
        set(self.cohesion, &mut law.cohesion);
        set(self.tensile_strength, &mut law.tensile_strength);
        set(self.normal_stiffness, &mut law.normal_stiffness);
        set(self.shear_stiffness, &mut law.shear_stiffness);
    }
}

/// An override that applies to a block, and the sides on which it names the block.
#[derive(Clone, Copy, Debug)]
struct SideOverride {
    number: u32,
    on: [bool; 2],
}

/// Contact laws of all pairs of blocks.
#[derive(Clone, Debug)]
pub(crate) struct ContactLaws {
    general: ContactLaw,
    /// In rising rank.
    overrides: Vec<PairOverride>,
    /// Overrides of each block, in rising rank, one list after the other; and the start of each
    /// list.
    meant: Vec<SideOverride>,
    start: Vec<u32>,
}

impl ContactLaws {
    /// Builds the laws of the blocks of a scene. [`ContactPair`] defines the rank of pairs.
    pub(crate) fn new<const D: usize>(scene: &Scene, mesh: &Mesh<D>) -> Self {
        let contact = &scene.contact;
        let general = ContactLaw {
            enabled: true,
            friction: contact.strength.friction_angle.tan(),
            cohesion: contact.strength.cohesion,
            tensile_strength: contact.strength.tensile_strength,
            normal_stiffness: contact.normal_stiffness.unwrap_or(0.0),
            shear_stiffness: contact.shear_stiffness.unwrap_or(0.0),
        };
        let of_block = |name: &String| -> Vec<usize> { parts(scene, mesh, name).collect() };
        let of_material = |name: &String| -> Vec<usize> {
            let blocks = mesh.blocks.iter().enumerate();
            let meant = blocks.filter(|(_, block)| scene.block[block.source].material == *name);
            meant.map(|(number, _)| number).collect()
        };
        let (mut materials, mut blocks) = (Vec::new(), Vec::new());
        for pair in &contact.pair {
            let sides = pair.between.each_ref().map(of_block);
            if sides.iter().all(|side| !side.is_empty()) {
                blocks.push((PairOverride::new(pair), sides));
            } else {
                let sides = pair.between.each_ref().map(of_material);
                materials.push((PairOverride::new(pair), sides));
            }
        }
        materials.extend(blocks);
        Self::of(general, materials, mesh.blocks.len())
    }

    /// Builds the laws of `count` blocks from overrides in rising rank, each with the blocks on
    /// its two sides.
    fn of(general: ContactLaw, ranked: Vec<(PairOverride, [Vec<usize>; 2])>, count: usize) -> Self {
        let mut of_block: Vec<Vec<SideOverride>> = vec![Vec::new(); count];
        for (number, (_, sides)) in (0..).zip(&ranked) {
            for (side, blocks) in sides.iter().enumerate() {
                for &block in blocks {
                    let of_block = &mut of_block[block];
                    if of_block.last().is_none_or(|last| last.number != number) {
                        let on = [false; 2];
                        of_block.push(SideOverride { number, on });
                    }
                    if let Some(last) = of_block.last_mut() {
                        last.on[side] = true;
                    }
                }
            }
        }
        let mut start = vec![0];
        start.extend(of_block.iter().scan(0, |end, meant| {
            *end += meant.len() as u32;
            Some(*end)
        }));
        Self {
            general,
            overrides: ranked.into_iter().map(|(pair, _)| pair).collect(),
            meant: of_block.concat(),
            start,
        }
    }

    /// Returns the law between two blocks.
    pub(crate) fn between(&self, a: u32, b: u32) -> ContactLaw {
        let mut law = self.general;
        let [mut one, mut other] = [a, b].map(|block| {
            let block = block as usize;
            &self.meant[self.start[block] as usize..self.start[block + 1] as usize]
        });
        while let ([first, rest @ ..], [second, remaining @ ..]) = (one, other) {
            if first.number == second.number
                && (first.on[0] && second.on[1] || first.on[1] && second.on[0])
            {
                self.overrides[first.number as usize].apply(&mut law);
            }
            if first.number <= second.number {
                one = rest;
            }
            if second.number <= first.number {
                other = remaining;
            }
        }
        law
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GENERAL: ContactLaw = ContactLaw {
        enabled: true,
        friction: 0.5,
        cohesion: 1.0,
        tensile_strength: 2.0,
        normal_stiffness: 3.0,
        shear_stiffness: 4.0,
    };

    fn overrides() -> impl Strategy<Value = Vec<(PairOverride, [Vec<usize>; 2])>> {
        let side = || proptest::collection::vec(0..6_usize, 0..4);
        let value = || proptest::option::of(0.0..9.0_f64);
        let one = (
            proptest::option::of(any::<bool>()),
            [value(), value(), value(), value(), value()],
            [side(), side()],
        );
        let one = one.prop_map(|(enabled, value, sides)| {
            let pair = PairOverride {
                enabled,
                friction: value[0],
                cohesion: value[1],
                tensile_strength: value[2],
                normal_stiffness: value[3],
                shear_stiffness: value[4],
            };
            (pair, sides)
        });
        proptest::collection::vec(one, 0..8)
    }

    proptest! {
        #[test]
        fn later_overrides_of_both_blocks_rank_above_earlier_ones(ranked in overrides()) {
            let laws = ContactLaws::of(GENERAL, ranked.clone(), 6);
            for a in 0..6 {
                for b in 0..6 {
                    let mut wanted = GENERAL;
                    for (pair, [one, other]) in &ranked {
                        if one.contains(&a) && other.contains(&b)
                            || one.contains(&b) && other.contains(&a)
                        {
                            pair.apply(&mut wanted);
                        }
                    }
                    prop_assert_eq!(laws.between(a as u32, b as u32), wanted);
                }
            }
        }
    }
}
