//! Stones side by side: their joints neither stop nor push what slides over or lands on them.

use cdem::mesh::ElementKind;
use cdem_verify::{Case, load, run};

/// Velocity of the block at the end, m/s, and how many contacts have begun.
fn ends(case: &Case) -> ([f64; 3], u64) {
    let mut simulation = case.start();
    run(&mut simulation, |_| ());
    let rows = simulation.block_rows();
    let row = rows.iter().find(|row| row.block == "block");
    let velocity = row.expect("a block").velocity;
    println!(
        "{velocity:.3?} m/s, {} contacts begun",
        simulation.contacts_begun()
    );
    (velocity, simulation.contacts_begun())
}

#[test]
fn what_slides_over_joints_keeps_its_speed() {
    // From the joint, within the tolerance of 5e-5 m of it, and clear of it.
    for beside in [0.0, 1e-5, -1e-5, 4e-5, -4e-5, 1e-3] {
        let mut case = load("pavement");
        case.block("block").translate[0] = 0.5 + beside;
        let ([x, ..], contacts) = ends(&case);
        assert!(contacts > 0);
        // Round-off of velocities of nodes, a step at a time.
        assert!((x / 5.0 - 1.0).abs() < 1e-12, "{beside:e}: {x}");
    }
}

#[test]
fn what_lands_beside_a_joint_is_not_pushed_aside() {
    for kind in [ElementKind::Hex8, ElementKind::Tet4] {
        for beside in [0.0, 1e-5, -8e-5, 1e-3] {
            let mut case = load("pavement-3d");
            for name in ["stone-0", "stone-1", "stone-2", "stone-3", "block"] {
                case.divide(name, &[1, 2, 1], kind);
            }
            case.scene.contact.tolerance = Some(5e-5);
            case.block("block").translate[0] = beside;
            let ([x, y, z], contacts) = ends(&case);
            assert!(contacts > 0 && z > 0.0, "it bounces");
            // Its lower face turns by the strain of the impact, v/c, at most.
            let strain = 1.0 / (1e9_f64 / 2000.0).sqrt();
            assert!(
                x.abs().max(y.abs()) < strain,
                "{kind:?} {beside:e}: {x:e} {y:e}"
            );
        }
    }
}

/// What a block lies in stones by at the start is the user's, on one too that it only comes
/// to press on later.
#[test]
fn what_overlaps_at_the_start_is_not_parted_later() {
    let mut case = load("pavement");
    case.scene.time.end = 0.09; // to 0.05 m before the next joint
    let tolerance = case.start().scene().contact.tolerance.expect("filled in");
    case.block("block").translate = vec![0.5, -0.8 * tolerance];
    let mut simulation = case.start();
    let begun = simulation.contacts_begun();
    run(&mut simulation, |_| ());
    assert!(simulation.contacts_begun() > begun, "on the next stone");
    assert_eq!(simulation.corrections().count, 0);
}
