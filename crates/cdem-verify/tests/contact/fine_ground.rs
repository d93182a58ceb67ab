//! Ground with faces shorter than the slip of a block in a step.

use cdem_verify::{load, run};

/// Length of a face, radius of the trough, and distance of the box's centre from its axis, m.
const FACE: f64 = 5e-3;
const RADIUS: f64 = 10.0;
const ARM: f64 = 9.737_491_2;

/// Runs the scene with a step, s. Returns the number of warnings about fast sliding.
fn slides(step: Option<f64>) -> usize {
    let mut case = load("fine-ground");
    case.scene.time.step = step;
    let end = case.scene.time.end;
    let mut simulation = case.start();
    let way = 10.0 * end / simulation.step_count() as f64;
    run(&mut simulation, |_| ());
    let rows = simulation.block_rows();
    let row = rows.iter().find(|row| row.block == "box").expect("a box");
    let angle = 10.0 / ARM * end;
    let exact = [10.0 * angle.cos(), 10.0 * angle.sin()];
    let off = f64::hypot(row.velocity[0] - exact[0], row.velocity[1] - exact[1]);
    let depth = simulation.max_penetration();
    let told = simulation.warnings();
    let told = told
        .iter()
        .filter(|text| text.contains("slid farther"))
        .count();
    println!("fine-ground, {way:.2e} m a step: velocity off by {off:.1e} m/s, {depth:.1e} m deep");
    // The corners follow chords of a face or a step; these turn by their length over R.
    assert!(off < 10.0 * way.max(FACE) / RADIUS, "{off:e}");
    assert!(depth < 1e-4 * FACE, "{depth:e}");
    told
}

#[test]
fn what_slides_over_faces_shorter_than_its_way_in_a_step_stays_on_them() {
    for (step, tells) in [
        (None, 1),
        (Some(2e-4), 0),
        (Some(6.25e-4), 0),
        (Some(1e-3), 1),
    ] {
        assert_eq!(slides(step), tells, "{step:?}");
    }
}
