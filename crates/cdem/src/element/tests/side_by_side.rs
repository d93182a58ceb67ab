//! Elements that are worked out side by side in a register.

use super::*;
use crate::mesh::Block;

/// What kicks give and leave.
#[derive(PartialEq)]
struct Given<const D: usize> {
    impulse: Vec<[f64; D]>,
    viscous: Vec<[f64; D]>,
    records: Vec<Vec<f64>>,
}

/// A mesh of which the first third of the elements is one block and the rest another: some
/// elements of both lie in one register.
fn in_two_blocks<const D: usize>(mut mesh: Mesh<D>) -> Mesh<D> {
    let whole = mesh.blocks[0].clone();
    let cut = whole.elements.end / 3;
    mesh.blocks[0].elements.end = cut;
    mesh.blocks.push(Block {
        elements: cut..whole.elements.end,
        ..whole
    });
    mesh
}

/// Two kicks of all elements, as many at once as `due` says.
fn kicks<const D: usize>(
    mesh: &Mesh<D>,
    kinematics: Kinematics,
    due: impl Fn(&[u32]) -> Vec<Vec<u32>>,
) -> Given<D> {
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
    let still = vec![[0.0; D]; mesh.nodes.len()];
    let [mut impulse, mut viscous] = [still.clone(), still];
    for number in 0..2 {
        let (displacement, velocity) = (field(0.05, number), field(2.0, 10 + number));
        for set in &mut sets {
            for due in due(&all(&**set)) {
                let interval: Vec<f64> = due.iter().map(|&i| 1e-3 * f64::from(1 + i)).collect();
                set.kick(
                    &due,
                    &interval,
                    &displacement,
                    &velocity,
                    &mut impulse,
                    &mut viscous,
                );
            }
        }
    }
    let records = sets
        .iter()
        .flat_map(|set| (0..set.len()).map(|i| set.record(i).to_vec()));
    let records = records.collect();
    Given {
        impulse,
        viscous,
        records,
    }
}

fn alone_and_together<const D: usize>() {
    for kind in kinds::<D>() {
        for kinematics in KINEMATICS {
            let mesh = in_two_blocks(distorted::<D>([3; D], kind, 0.1));
            let together = kicks(&mesh, kinematics, |all| vec![all.to_vec()]);
            let alone = kicks(&mesh, kinematics, |all| {
                all.iter().map(|&i| vec![i]).collect()
            });
            assert!(largest(&alone.impulse) > 0.0 && largest(&alone.viscous) > 0.0);
            assert!(together == alone, "{kind:?} {kinematics:?}");
        }
    }
}

#[test]
fn elements_give_the_same_bits_alone_and_side_by_side() {
    alone_and_together::<2>();
    alone_and_together::<3>();
}
