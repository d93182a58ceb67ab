//! A fall is an impact, however soft the block. What a touch loses beyond `energy_loss` is told.

use cdem::scene::Geometry;
use cdem_verify::{Case, Random, load, run};

/// Result of a drop.
#[derive(Debug)]
struct Drop {
    /// Most refined blocks at once.
    refined: u64,
    /// Impact loss over the energy of the fall.
    loss: f64,
    contacts: u64,
    /// Warnings that name `energy_loss`.
    told: Vec<String>,
}

/// Runs a case.
fn fall(case: &Case) -> Drop {
    let mut simulation = case.start();
    let mut refined = 0;
    run(&mut simulation, |simulation| {
        refined = refined.max(simulation.history().refined_blocks);
    });
    let end = simulation.history();
    let warnings = simulation.warnings().into_iter();
    Drop {
        refined,
        loss: end.impact_loss / end.gravity_work,
        contacts: simulation.contacts_begun(),
        told: warnings
            .filter(|told| told.contains("energy_loss"))
            .collect(),
    }
}

#[test]
fn a_soft_cube_is_refined() {
    let drop = fall(&load("soft-drop"));
    println!("{drop:?}");
    assert!(drop.contacts > 0 && drop.refined == 1, "{drop:?}");
    assert!(drop.told.is_empty(), "{drop:?}");
}

/// The cube stays as it is. The warning names both blocks and the time of the touch.
#[test]
fn what_a_coarse_cube_loses_is_told() {
    let mut case = load("soft-drop");
    case.scene.contact.max_level = 0;
    let drop = fall(&case);
    println!("{drop:?}");
    assert!(drop.refined == 0 && drop.told.len() == 1, "{drop:?}");
    for word in ["\"cube\"", "\"plate\"", "at t = ", "lost"] {
        assert!(drop.told[0].contains(word), "{word}: {drop:?}");
    }
}

/// Turns the scene into a drop of a cube of any size and modulus from any height, m.
fn any_drop(random: &mut Random) -> Case {
    let mut case = load("soft-drop");
    let size = 10_f64.powf(random.between(-1.0, 0.7));
    let modulus = 10_f64.powf(random.between(5.0, 10.0)).max(1e5 * size);
    // The strain of the impact is the speed over that of waves.
    let wave_speed = (2.14 * modulus / 1000.0).sqrt();
    let speed = wave_speed * 10_f64.powf(random.between(-4.0, -2.0));
    let height = (speed * speed / 19.62).max(1e-4 * size);
    case.scene.material[0].young_modulus = modulus;
    case.scene.time.end = (height / 4.9).sqrt() + 3.0 * size / wave_speed;
    for (name, side) in [("cube", size), ("plate", 3.0 * size)] {
        if let Geometry::Box { min, max, .. } = &mut case.block(name).geometry {
            *min = vec![-0.5 * side, 0.0, -0.5 * side];
            *max = vec![0.5 * side, size, 0.5 * side];
        }
    }
    let cube = case.block("cube");
    cube.rotate.angle = 0.0;
    cube.translate = vec![0.0, size + height, 0.0];
    case
}

#[test]
#[ignore = "slow study: two hundred drops"]
fn any_drop_is_refined_or_told_of() {
    let mut random = Random(41);
    for _ in 0..200 {
        let drop = fall(&any_drop(&mut random));
        println!("{drop:?}");
        assert!(drop.contacts > 0, "{drop:?}");
        assert!(drop.loss < 0.01 || !drop.told.is_empty(), "{drop:?}");
    }
}
