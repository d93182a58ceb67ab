//! Stones side by side: their joints neither stop nor push a block that slides over them or lands
//! on them.

use cdem::mesh::ElementKind;
use cdem_verify::{Case, load, run};

/// Returns the velocity of the block at the end, m/s, and the number of contacts begun.
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
    // From the joint, from within the tolerance of 5e-5 m of it, and from outside it.
    for beside in [0.0, 1e-5, -1e-5, 4e-5, -4e-5, 1e-3] {
        let mut case = load("pavement");
        case.block("block").translate[0] = 0.5 + beside;
        let ([x, ..], contacts) = ends(&case);
        assert!(contacts > 0);
        // Round-off of nodal velocities, once per step.
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
            // Its lower face rotates by at most the strain of the impact, v/c.
            let strain = 1.0 / (1e9_f64 / 2000.0).sqrt();
            assert!(
                x.abs().max(y.abs()) < strain,
                "{kind:?} {beside:e}: {x:e} {y:e}"
            );
        }
    }
}

/// An overlap of a block and stones at the start is part of the scene, also on a stone that the
/// block presses only later.
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
