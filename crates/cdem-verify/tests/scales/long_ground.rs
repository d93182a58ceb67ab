//! The larger block of a collision takes part as far as waves get in it, not as a whole.

use cdem::scene::Geometry;
use cdem_verify::{load, run};

/// Motion and loss of a stone after its touch with the ground.
#[derive(Debug)]
struct Rebound {
    /// Angular velocity, rad/s.
    spin: f64,
    /// Impact loss over the energy of the fall.
    loss: f64,
    elements: u64,
}

/// Drops the stone on a ground of this length, m.
fn fall(length: usize) -> Rebound {
    let mut case = load("long-ground");
    let Geometry::Box {
        min,
        max,
        divisions,
        ..
    } = &mut case.block("ground").geometry
    else {
        panic!("the ground is a box");
    };
    (min[0], max[0]) = (-0.5 * length as f64, 0.5 * length as f64);
    divisions[0] = length;
    let mut simulation = case.start();
    let start = simulation.history().elements;
    let mut added = 0;
    run(&mut simulation, |simulation| {
        added = added.max(simulation.history().elements - start);
    });
    let end = simulation.history();
    Rebound {
        spin: simulation.block_rows()[0].angular_velocity[2],
        loss: end.impact_loss / end.gravity_work,
        elements: added,
    }
}

/// Checks that the rebound on grounds of these lengths, m, is that on one of 20 m.
fn check(lengths: &[usize]) {
    let short = fall(20);
    println!("20 m: {short:?}");
    assert!(short.elements > 0 && short.spin.abs() > 1.0, "{short:?}");
    for &length in lengths {
        let long = fall(length);
        println!("{length} m: {long:?}");
        assert_eq!(long.elements, short.elements, "{length} m");
        assert!((long.spin / short.spin - 1.0).abs() < 0.01, "{long:?}");
        assert!((long.loss / short.loss - 1.0).abs() < 0.01, "{long:?}");
    }
}

#[test]
fn the_length_of_the_ground_does_not_matter() {
    check(&[80]);
}

#[test]
#[ignore = "slow study: grounds of up to 200 m"]
fn no_length_of_the_ground_matters() {
    check(&[40, 80, 120, 200]);
}
