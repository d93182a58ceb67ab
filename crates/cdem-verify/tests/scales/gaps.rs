//! Stones with narrow gaps, whose meshes change all the time under pressure.

use cdem_verify::{Balance, Case, load, run};

/// Largest rise of the energy, over the energy exchanged. Half-steps and changes of time levels shift
/// 3e-5 and, with the slow variants, 3e-4 between measured energies and losses. Gap errors of changes
/// of mesh, once corrected in each substep, gave 200 times the energy that there was.
const RISE: f64 = 1e-3;

fn check(what: &str, case: &Case) {
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    run(&mut simulation, |simulation| {
        balance.look(simulation);
    });
    println!(
        "{what}: rise {:.1e}, residual {:.1e}",
        balance.rise, balance.residual
    );
    assert!(balance.rise < RISE, "{what}: {balance:?}");
}

#[test]
fn stones_with_gaps_gain_no_energy() {
    check("gaps of 0.1 mm", &load("stones-with-gaps"));
}

#[test]
#[ignore = "slow study: a wall with other tolerances, frictions, stiffnesses and dampings"]
fn stones_with_gaps_gain_no_energy_in_any_variant() {
    for tolerance in [None, Some(3e-4)] {
        for [modulus, damping, friction] in [
            [1e10, 0.0, 30.0],
            [1e10, 1e-5, 30.0],
            [1e9, 0.0, 30.0],
            [1e10, 0.0, 0.0],
        ] {
            let mut case = load("stones-with-gaps");
            case.scene.contact.tolerance = tolerance;
            case.scene.contact.strength.friction_angle = f64::to_radians(friction);
            case.scene.material[0].young_modulus = modulus;
            case.scene.material[0].damping.stiffness = damping;
            let what = format!(
                "tolerance {tolerance:?} m, {modulus:e} Pa, damping {damping} s, {friction} degrees"
            );
            check(&what, &case);
        }
    }
}
