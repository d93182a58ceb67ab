//! Joints: they have strength until they break, and none after.

use cdem::mesh::ElementKind;
use cdem::scene::{LoadKind, Schedule};
use cdem_verify::{Case, load, run};

/// Returns the largest pull of the joint, N, its time, s, and the largest pull later than `pause`
/// seconds after it.
fn pull(case: &Case, pause: f64, pull: impl Fn([f64; 3]) -> f64 + Sync) -> [f64; 3] {
    let mut simulation = case.start();
    let (mut most, mut when, mut after) = (0.0, 0.0, 0.0_f64);
    simulation.block_rows();
    run(&mut simulation, |simulation| {
        let pulled = pull(simulation.block_rows()[1].force);
        if pulled > most {
            (most, when, after) = (pulled, simulation.time(), 0.0);
        } else if simulation.time() > when + pause {
            after = after.max(pulled);
        }
    });
    println!(
        "bears {most:.6e} N at {when:.5} s; after that {after:.1e} N; {} contacts begun",
        simulation.contacts_begun()
    );
    [most, when, after]
}

#[test]
fn a_joint_parts_at_its_tensile_strength_and_has_none_after() {
    let case = load("joint");
    let [most, when, after] = pull(&case, 0.0, |force| -force[1]);
    // The pull never exceeds the strength. It is lower by at most the growth of the load in a step
    // (1e3 N) and the vibration from the ramp: 2 MN/s over 2 pi / T of the longest mode, T = 8 m /
    // c: 0.36 %.
    assert!(most <= 1e6 * (1.0 + 1e-9) && most > 1e6 * 0.99, "{most}");
    assert!((when / 0.5 - 1.0).abs() < 0.01, "{when}");
    assert!(after < 1.0, "{after}"); // N: one part in a million
}

#[test]
fn a_joint_slips_at_its_cohesion_and_has_none_after() {
    let mut case = load("joint");
    // One element each, so that the two points carry equal shear, and a tensile strength that
    // carries the moment.
    for block in ["lower", "upper"] {
        case.divide(block, &[1, 1], ElementKind::Quad4);
    }
    case.scene.contact.strength.tensile_strength = 1e9;
    case.scene.contact.strength.friction_angle = 0.0;
    case.scene.time.end = 0.42;
    let ramp = vec![(0.0, vec![0.0, 0.0]), (0.5, vec![1e6, 0.0])];
    case.scene.load[0].kind = LoadKind::Traction(Schedule::Table(ramp));
    // Its two points slip one after the other as waves carry the load to the next: a round trip
    // through both blocks.
    let round_trip = 4.0 / (1e9_f64 / 2000.0).sqrt();
    let [most, when, after] = pull(&case, round_trip, |force| -force[0]);
    assert!(
        most <= 0.8e6 * (1.0 + 1e-9) && most > 0.8e6 * 0.99,
        "{most}"
    );
    assert!((when / 0.4 - 1.0).abs() < 0.02, "{when}");
    assert!(after < 1.0, "{after}");
}

/// The blocks overlap by half of the tolerance at the start and are pressed together. The initial
/// overlap is part of the scene, so no contact begins beside its joint.
#[test]
fn a_joint_that_overlaps_at_the_start_lasts() {
    for (name, up) in [("joint", 1), ("joint-3d", 2)] {
        let mut case = load(name);
        case.scene.time.end = 0.05;
        let tolerance = case.start().scene().contact.tolerance.expect("filled in");
        case.block("upper").translate[up] = -0.5 * tolerance;
        let mut pressed = vec![0.0; up + 1];
        pressed[up] = -1e6;
        let ramp = vec![(0.0, vec![0.0; up + 1]), (0.05, pressed)];
        case.scene.load[0].kind = LoadKind::Traction(Schedule::Table(ramp));
        let mut simulation = case.start();
        let joined = simulation.contacts_begun();
        run(&mut simulation, |_| ());
        assert!(joined > 0, "{name}");
        assert_eq!(simulation.contacts_begun(), joined, "{name}");
        assert_eq!(simulation.live_contacts().len() as u64, joined, "{name}");
        assert_eq!(simulation.corrections().count, 0, "{name}");
    }
}
