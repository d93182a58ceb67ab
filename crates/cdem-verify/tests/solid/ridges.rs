//! Sharp edges that lie on each other.

use cdem_verify::{Balance, deepest_overlap, load, run};

/// Edges that coincide as they meet have no common normal. If both ends slide off to different
/// sides, the edges cross in the middle within the same drift.
#[test]
fn ridges_that_meet_in_one_line_do_not_sink_in() {
    let mut bounces = Vec::new();
    for speed in [1.0, 3.0, 7.0] {
        for friction in [0.0, 30.0] {
            for [x, y] in [[0.0, 0.0], [0.5, 0.0], [0.0, 1e-6], [0.3, 1e-5]] {
                let mut case = load("knife-edges");
                case.scene.contact.strength.friction_angle = f64::to_radians(friction);
                let above = case.block("above");
                above.velocity = vec![0.0, 0.0, -speed];
                above.translate = vec![x, y, 0.005];
                let mut simulation = case.start();
                let tolerance = simulation.scene().contact.tolerance.expect("filled in");
                let mut balance = Balance::new(&mut simulation);
                let mut deepest = 0.0_f64;
                run(&mut simulation, |simulation| {
                    balance.look(simulation);
                    deepest = deepest.max(deepest_overlap(&simulation.frame()));
                });
                let what = format!("{speed} m/s, {friction}°, {x} {y}");
                bounces.push(deepest / tolerance);
                assert!(deepest < tolerance, "{what}: {deepest:e} of {tolerance:e}");
                assert!(simulation.max_penetration() < tolerance, "{what}");
                assert_eq!(simulation.corrections().count, 0, "{what}");
                assert!(balance.momentum < 1e-12, "{what}: {balance:?}");
                assert!(balance.growth < 2e-2, "{what}: {balance:?}");
                // Limit of the ledger for blocks of one element.
                assert!(balance.residual < 2e-2, "{what}: {balance:?}");
            }
        }
    }
    let deepest = bounces.iter().copied().fold(0.0, f64::max);
    println!(
        "ridges: {} bounces, at most {deepest:.2} of the tolerance",
        bounces.len()
    );
}
