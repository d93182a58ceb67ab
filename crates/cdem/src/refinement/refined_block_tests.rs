//! Random changes of zones: masses and volumes that each overlay preserves, and nesting of the
//! meshes before and after each change.

use std::collections::BTreeSet;

use fastrand::Rng;

use crate::element::tests::kinds;
use crate::math::vector::sub;
use crate::mesh::{ElementKind, tests};
use crate::model::Model;
use crate::refinement::dimension::{PLANE, SOLID, Space};
use crate::refinement::refined_block::RefinedBlock;
use crate::refinement::tests::volume;
use crate::refinement::zone::{FLUSH_GRADING, GRADING, Zone};
use crate::refinement::{Adaptivity, MeshTransfer};
use crate::scene::{ContactModel, Damping, Geometry, Kinematics, Mass, Material, MaterialModel};

/// Builds two boxes of random divisions, the first of which is refined. Its mass kind is random.
fn boxes<const D: usize>(
    kind: ElementKind,
    rng: &mut Rng,
    space: Space<D>,
    kinematics: Kinematics,
) -> Adaptivity<D> {
    let block = |name: &str, from: f64, divisions: Vec<usize>| {
        let mut min = vec![0.0; D];
        min[0] = from;
        let geometry = Geometry::Box {
            max: min.iter().map(|x| x + 1.0).collect(),
            min,
            divisions,
            element: kind,
        };
        tests::block(name, geometry)
    };
    let divisions = (0..D).map(|_| rng.usize(1..=3)).collect();
    let mut one = block("one", 0.0, divisions);
    one.kinematics = kinematics;
    one.mass = [Mass::Auto, Mass::Lumped][rng.usize(..2)];
    let mut scene = tests::scene(D, vec![one, block("other", 3.0, vec![1; D])]);
    scene.material.push(Material {
        name: "rock".to_owned(),
        model: MaterialModel::Elastic,
        young_modulus: 1.0,
        poisson_ratio: 0.2,
        density: 1.0,
        damping: Damping::default(),
    });
    scene.contact.model = ContactModel::TwoScale;
    let mesh = tests::shapes(scene.block.clone()).expect("boxes mesh");
    let built = Model::build(&mut scene, mesh, space).expect("the scene is whole");
    built.adaptivity.expect("two blocks on two scales")
}

fn zone<const D: usize>(rng: &mut Rng) -> Zone<D> {
    Zone {
        centre: std::array::from_fn(|_| [0.0, rng.f64(), 1.0][rng.usize(..3)]),
        radius: [0.0, 0.1][rng.usize(..2)],
        finest: 0.5_f64.powi(rng.i32(1..=7 - D as i32)),
        grading: if D == 2 {
            [GRADING, FLUSH_GRADING][rng.usize(..2)]
        } else {
            GRADING
        },
        until: 0,
    }
}

/// Mass and centre are those of the block; so is the volume, to the round-off of a sum.
fn check<const D: usize>(second: &Adaptivity<D>, refined_block: &RefinedBlock<D>, case: &str) {
    let overlay = &refined_block.overlay;
    let mass: f64 = refined_block.mass.iter().sum();
    let nodes = &second.base_model.mesh.blocks[0].nodes;
    let before = &second.base_model.masses.nodal[nodes.start as usize..nodes.end as usize];
    let lack = mass - before.iter().sum::<f64>();
    // Round-off of a fit and of the weights of two quadratures, in a block of 1 kg.
    assert!(lack.abs() < 1e-13, "{case}: {lack:e}");
    for c in 0..D {
        let moment = overlay.points.iter().zip(&refined_block.mass);
        let centre: f64 = moment.map(|(point, mass)| mass * point[c]).sum();
        assert!((centre - 0.5).abs() < 1e-13, "{case}: {centre}");
    }
    let mesh = &second.base_model.mesh;
    let corners = |nodes: &[u32], points: &[[f64; D]]| -> Vec<[f64; D]> {
        nodes.iter().map(|&node| points[node as usize]).collect()
    };
    let roots: BTreeSet<u32> = overlay.replaced.iter().copied().collect();
    let kept = mesh.blocks[0].elements.len() - roots.len();
    // All base elements of a box have the same volume.
    let share = kept as f64 / mesh.blocks[0].elements.len() as f64;
    let volumes = overlay.elements.iter().map(|sub| {
        let volume = volume(&corners(sub.element.nodes(), &overlay.points));
        assert!(volume > 0.0, "{case}");
        sub.weight * volume
    });
    let whole = volumes.sum::<f64>() + share;
    assert!((whole - 1.0).abs() < 1e-13, "{case}: {whole}");
}

/// Adds and removes zones `count` times; in the end all are gone, and so is the overlay.
fn come_and_go<const D: usize>(space: Space<D>, count: usize) {
    for kind in kinds::<D>() {
        let mut rng = Rng::with_seed(11);
        let (mut changes, mut refused) = (0, 0);
        while changes < count {
            let second = boxes(kind, &mut rng, space, Kinematics::Total);
            let base_model = &second.base_model;
            let (mut zones, mut refined_block): (Vec<Zone<D>>, Option<RefinedBlock<D>>) =
                (Vec::new(), None);
            for _ in 0..20 {
                let is_more = zones.len() < 2 || (zones.len() < 5 && rng.bool());
                let mut next = zones.clone();
                let wanted = if is_more {
                    next.push(zone(&mut rng));
                    RefinedBlock::finer(base_model, 0, &next, refined_block.as_ref())
                } else {
                    next.swap_remove(rng.usize(..next.len()));
                    RefinedBlock::coarser(base_model, 0, &next, refined_block.as_ref())
                };
                let Ok(other) = wanted else {
                    refused += 1;
                    continue;
                };
                let case = format!("{kind:?} {changes}");
                if refined_block.is_some() || other.is_some() {
                    let lame = base_model.lame(0);
                    let transfer =
                        MeshTransfer::between(refined_block.as_ref(), other.as_ref(), lame);
                    assert!(transfer.is_some(), "{case}: one refines the other");
                }
                if let Some(other) = &other {
                    check(&second, other, &case);
                }
                (zones, refined_block) = (next, other);
                changes += 1;
            }
            let gone = RefinedBlock::coarser(base_model, 0, &[], refined_block.as_ref());
            assert!(gone.is_ok_and(|refined_block| refined_block.is_none()));
            assert_eq!(second.mesh(), base_model.mesh);
        }
        assert!(refused * 10 < changes, "{kind:?}: {refused} of {changes}");
    }
}

#[test]
fn zones_in_the_plane_come_and_go() {
    come_and_go(PLANE, 200);
}

#[test]
fn zones_in_space_come_and_go() {
    come_and_go(SOLID, 40);
}

#[test]
#[ignore = "slow study: ten thousand changes of mesh"]
fn zones_come_and_go_ten_thousand_times() {
    come_and_go(PLANE, 4000);
    come_and_go(SOLID, 1000);
}

/// A contact that slides out of the middle of its zone moves the zone, at any speed; a contact
/// elsewhere does not.
#[test]
fn zones_go_with_what_slides() {
    let zone = Zone {
        centre: [0.0, 0.0],
        radius: 0.0,
        finest: 0.1,
        grading: GRADING,
        until: 0,
    };
    assert!(zone.is_left_by(&[0.07, 0.0], [0.08, 0.001]));
    assert!(zone.is_left_by(&[0.2, 0.0], [0.3, 0.15]));
    assert!(!zone.is_left_by(&[0.2, 0.0], [0.3, 0.001]));
    assert!(!zone.is_left_by(&[0.07, 0.0], [0.01, 0.01]));
    assert!(!zone.is_left_by(&[0.03, 0.0], [0.08, 0.08]));
}

/// There is a time level for elements of a block halved as often as `halvings` allows.
fn there_are_levels<const D: usize>(space: Space<D>) {
    for kind in kinds::<D>() {
        let second = boxes(kind, &mut Rng::with_seed(1), space, Kinematics::Total);
        let halvings = second.halvings(second.base_model.mesh.blocks[0].elements.clone());
        assert!(halvings > 8, "{kind:?}: {halvings}");
        let deep = Zone {
            centre: [0.0; D],
            radius: 0.0,
            finest: second.base_model.size(0) * 0.5_f64.powi(halvings as i32),
            grading: GRADING,
            until: 0,
        };
        let refined_block = RefinedBlock::finer(&second.base_model, 0, &[deep], None);
        assert!(matches!(refined_block, Ok(Some(_))), "{kind:?}");
    }
}

#[test]
fn there_are_levels_for_what_may_be_halved() {
    there_are_levels::<2>(PLANE);
    there_are_levels::<3>(SOLID);
}

#[test]
fn what_is_no_deformation_has_no_rotation() {
    for size in [2, 3] {
        let torn = nalgebra::DMatrix::from_element(size, size, f64::NAN);
        let unit = nalgebra::DMatrix::identity(size, size);
        assert_eq!(crate::refinement::prolongation::rotation(torn), unit);
    }
}

/// The strain energy of a block does not depend on its rotation.
fn turns_are_no_strain<const D: usize>(space: Space<D>) {
    const STRETCH: f64 = 1e-4;
    for kind in kinds::<D>() {
        for kinematics in [Kinematics::Total, Kinematics::Incremental] {
            let second = boxes(kind, &mut Rng::with_seed(7), space, kinematics);
            let base_model = &second.base_model;
            let nodes = &base_model.mesh.blocks[0].nodes;
            let nodes = &base_model.mesh.nodes[nodes.start as usize..nodes.end as usize];
            let energy_at = |degrees: f64| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let displacement = nodes.iter().map(|point| {
                    let mut moved = *point;
                    let along = (1.0 + STRETCH) * point[0];
                    moved[0] = cos * along - sin * point[1];
                    moved[1] = sin * along + cos * point[1];
                    sub(&moved, point)
                });
                base_model.strain_energy(0, None, &displacement.collect::<Vec<_>>())
            };
            let straight = energy_at(0.0);
            assert!(straight > 0.0);
            for degrees in [30.0, 90.0, 179.0, 180.0, 270.0] {
                let off = energy_at(degrees) / straight - 1.0;
                assert!(
                    off.abs() < 1e-6,
                    "{kind:?} {kinematics:?} {degrees}: {off:e}"
                );
            }
        }
    }
}

#[test]
fn turns_in_the_plane_are_no_strain() {
    turns_are_no_strain(PLANE);
}

#[test]
fn turns_in_space_are_no_strain() {
    turns_are_no_strain(SOLID);
}
