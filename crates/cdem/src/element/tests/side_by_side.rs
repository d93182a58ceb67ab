//! Elements in SIMD lanes give the same bits as single elements.

use crate::element::tests::*;
use crate::mesh::MeshBlock;

/// Results of kicks.
struct Given<const D: usize> {
    /// Elastic and viscous impulses, kick by kick.
    impulses: Vec<[Vec<[f64; D]>; 2]>,
    records: Vec<Vec<f64>>,
}

/// Returns the same elements without common nodes.
fn torn<const D: usize>(mesh: &Mesh<D>) -> Mesh<D> {
    let mut torn = mesh.clone();
    torn.nodes.clear();
    for element in &mut torn.elements {
        let count = element.nodes().len();
        for node in &mut element.nodes[..count] {
            torn.nodes.push(mesh.nodes[*node as usize]);
            *node = torn.nodes.len() as u32 - 1;
        }
    }
    torn.blocks[0].nodes = 0..torn.nodes.len() as u32;
    torn
}

/// Returns the mesh with the first third of its elements in one block and the rest in another. Some
/// elements of both are in one SIMD batch.
fn in_two_blocks<const D: usize>(mut mesh: Mesh<D>) -> Mesh<D> {
    let whole = mesh.blocks[0].clone();
    let cut = whole.elements.end / 3;
    mesh.blocks[0].elements.end = cut;
    mesh.blocks.push(MeshBlock {
        elements: cut..whole.elements.end,
        ..whole
    });
    mesh
}

/// Makes two kicks of all elements: all at once, or each `alone`.
fn kicks<const D: usize>(mesh: &Mesh<D>, kinematics: Kinematics, alone: bool) -> Vec<Given<D>> {
    let material = Elastic {
        damping: Damping {
            stiffness: 1e-3,
            ..Damping::default()
        },
        ..rock()
    };
    let softer = Elastic {
        shear_modulus: 0.3 * material.shear_modulus,
        lame_lambda: 0.6 * material.lame_lambda,
        ..material
    };
    let properties = [0, 1].map(|material| BlockProperties {
        material,
        kinematics,
    });
    let materials = [material, softer];
    let mut sets = build(mesh, &properties, &materials, Plane::Strain, THICKNESS);
    let field = |size: f64, shift: usize| -> Vec<[f64; D]> {
        let nodes = 0..mesh.nodes.len();
        let of = |a| std::array::from_fn(|k| size * noise(a + shift, k));
        nodes.map(of).collect()
    };
    let count = mesh.elements.len() as u32;
    let intervals: Vec<f64> = (0..count).map(|e| 1e-3 * f64::from(1 + e)).collect();
    let due = Due {
        coarsest: 0,
        interval: Interval::OfElement(&intervals),
        updates_records: true,
    };
    let mut given = Vec::new();
    for number in 0..2 {
        let (displacement, velocity) = (field(0.05, number), field(2.0, 10 + number));
        let motion = [&displacement[..], &velocity[..]];
        let mut impulses = Vec::new();
        if alone {
            for e in 0..count {
                let levels = (0..count).map(|other| (e == other).then_some(0));
                let levels: Vec<_> = levels.collect();
                sets.iter_mut().for_each(|set| set.arrange(&levels));
                impulses.push(kick_over(&mut sets, &due, motion));
            }
        } else {
            impulses.push(kick_over(&mut sets, &due, motion));
        }
        let records = sets
            .iter()
            .flat_map(|set| (0..set.len()).map(|i| set.record(i)));
        let records = records.collect();
        given.push(Given { impulses, records });
    }
    given
}

/// Elements without common nodes give the same results alone and together, to the bit.
fn alone_and_together<const D: usize>() {
    for kind in kinds::<D>() {
        for kinematics in KINEMATICS {
            let mesh = in_two_blocks(torn(&distorted::<D>([3; D], kind, 0.1)));
            let together = kicks(&mesh, kinematics, false);
            let alone = kicks(&mesh, kinematics, true);
            for (together, alone) in together.iter().zip(&alone) {
                assert!(together.records == alone.records, "{kind:?} {kinematics:?}");
                let [elastic, viscous] = &together.impulses[0];
                assert!(largest(elastic) > 0.0 && largest(viscous) > 0.0);
                for (e, own) in alone.impulses.iter().enumerate() {
                    for &node in mesh.elements[e].nodes() {
                        let n = node as usize;
                        assert_eq!(own[0][n], elastic[n], "{kind:?} {kinematics:?}");
                        assert_eq!(own[1][n], viscous[n], "{kind:?} {kinematics:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn elements_give_the_same_bits_alone_and_side_by_side() {
    alone_and_together::<2>();
    alone_and_together::<3>();
}

/// Levels sort the elements again; impulses and records move with them.
fn levels_change_nothing<const D: usize>() {
    for kind in kinds::<D>() {
        let mesh = torn(&distorted::<D>([3; D], kind, 0.1));
        let sets = || sets_of(&mesh, rock(), Kinematics::Incremental, Plane::Strain);
        let (mut plain, mut sorted) = (sets(), sets());
        for number in 0..4 {
            let nodes = 0..mesh.nodes.len();
            let displacement: Vec<[f64; D]> = nodes
                .map(|a| std::array::from_fn(|k| 0.05 * noise(a + number, k)))
                .collect();
            let levels = (0..mesh.elements.len()).map(|e| Some((e * (number + 3) % 5) as u8));
            sorted[0].arrange(&levels.collect::<Vec<_>>());
            let forces = [&mut plain, &mut sorted].map(|sets| advance(sets, &displacement));
            assert!(forces[0] == forces[1], "{kind:?}");
            for i in 0..plain[0].len() {
                assert_eq!(plain[0].record(i), sorted[0].record(i), "{kind:?}");
            }
        }
    }
}

#[test]
fn elements_keep_their_past_whatever_their_levels() {
    levels_change_nothing::<2>();
    levels_change_nothing::<3>();
}
