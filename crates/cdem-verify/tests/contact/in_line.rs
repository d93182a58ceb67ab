//! Blocks whose edges lie in line.

use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Geometry, Rotation, Schedule};
use cdem_verify::{Balance, Case, Random, load, run};
use nalgebra::{Rotation3, Unit, Vector3};

#[test]
fn a_cube_rests_on_another_with_all_edges_in_line() {
    let mut simulation = load("aligned-edges").start();
    let mut balance = Balance::new(&mut simulation);
    run(&mut simulation, |simulation| {
        balance.look(simulation);
    });
    let force = simulation.block_rows()[1].force[1];
    println!(
        "the base bears {force:.1} N, residual {:.1e}",
        balance.residual
    );
    // The last bounces are told of: they are not refined.
    let mut warnings = simulation.warnings();
    warnings.retain(|warning| !warning.contains("energy_loss"));
    assert_eq!(warnings, [""; 0]);
    assert!(balance.residual < 1e-3, "{balance:?}");
    // The vibration has decayed to a few per cent of the weight.
    assert!((force / -9810.0 - 1.0).abs() < 0.05, "{force}");
    let slip = simulation
        .live_contacts()
        .iter()
        .map(|contact| contact.slip)
        .fold(0.0, f64::max);
    assert!(slip < 0.1, "{slip}");
}

/// Drops a cube of any size, modulus, mesh and height on an equal one, anywhere and turned as a
/// whole, with all edges in line.
fn any_drop_in_line(random: &mut Random) -> Case {
    let mut case = load("aligned-edges");
    let size = 10.0_f64.powf(random.between(-1.0, 1.0));
    let strain = 10.0_f64.powf(random.between(-4.0, -2.0));
    let drop = size * random.between(0.01, 0.1);
    let divisions = [random.whole(1, 2); 3];
    let element = [ElementKind::Tet4, ElementKind::Hex8][random.whole(0, 1)];
    let turn = Rotation {
        axis: {
            let axis = Vector3::from([(); 3].map(|()| random.between(-1.0, 1.0)));
            axis.normalize().into()
        },
        angle: random.between(0.0, std::f64::consts::TAU),
    };
    let turned = Rotation3::from_axis_angle(&Unit::new_normalize(turn.axis.into()), turn.angle);
    let shift = Vector3::from([(); 3].map(|()| random.between(-1.0, 1.0)));
    for (name, height) in [("base", 0.0), ("top", size + drop)] {
        case.divide(name, &divisions, element);
        let block = case.block(name);
        if let Geometry::Box { min, max, .. } = &mut block.geometry {
            (*min, *max) = (vec![0.0; 3], vec![size; 3]);
        }
        block.rotate = turn.clone();
        block.translate = (shift + turned * (Vector3::y() * height))
            .as_slice()
            .to_vec();
    }
    case.scene.gravity = Schedule::Constant((turned * (Vector3::y() * -9.81)).as_slice().to_vec());
    // The strain of an impact is the speed over that of waves.
    let speed = (2.0 * 9.81 * drop).sqrt();
    let wave_speed = speed / strain;
    let material = &mut case.scene.material[0];
    // For a Poisson's ratio of 0.4.
    material.young_modulus = 1000.0 * wave_speed.powi(2) / 2.14;
    material.damping.stiffness = 0.2 * size / wave_speed;
    case.scene.contact.tolerance = Some(size * 10.0_f64.powf(random.between(-6.0, -2.0)));
    // Two scales take a hundred times as long.
    case.scene.contact.model = match random.whole(0, 19) {
        0 => ContactModel::TwoScale,
        _ => ContactModel::UnifiedNode,
    };
    case.scene.time.end = speed / 9.81 + 6.0 * size / wave_speed;
    case
}

#[test]
#[ignore = "slow study: a thousand drops"]
fn no_cube_with_edges_in_line_seems_to_slide() {
    let mut random = Random(17);
    let mut touching = 0;
    for number in 0..1000 {
        let case = any_drop_in_line(&mut random);
        let mut simulation = case.start();
        run(&mut simulation, |_| {});
        touching += usize::from(simulation.contacts_begun() > 0);
        let mut warnings = simulation.warnings();
        warnings.retain(|warning| warning.contains("slid"));
        assert_eq!(warnings, [""; 0], "{number}: {:?}", case.scene);
    }
    assert_eq!(touching, 1000);
}
