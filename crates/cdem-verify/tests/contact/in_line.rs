//! Blocks whose edges lie in line.

use cdem_verify::{Balance, load, run};

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
