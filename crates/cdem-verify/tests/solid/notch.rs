//! A re-entrant corner.

use cdem_verify::{Balance, load, run};

#[test]
fn a_cube_slides_into_a_re_entrant_corner_and_stays() {
    let mut simulation = load("notch-3d").start();
    let tolerance = simulation.scene().contact.tolerance.expect("filled in");
    let mut balance = Balance::new(&mut simulation);
    run(&mut simulation, |simulation| {
        balance.look(simulation);
    });
    let cube = simulation.block_rows()[1].clone();
    let speed = cube.velocity.iter().map(|v| v.abs()).fold(0.0, f64::max);
    println!(
        "notch: centre at {:.9} {:.9}, speed {speed:.1e}, penetration {:.1e} (tolerance \
         {tolerance:.1e}), residual {:.1e}",
        cube.position[0],
        cube.position[2],
        simulation.max_penetration(),
        balance.residual,
    );
    for (c, gravity) in [(0, 5.0), (2, 9.81)] {
        // A quarter of the height, at half the stress at the foot, from each side.
        let shortened = 0.25 * 0.5 * 2600.0 * gravity * 0.5 / 1e9;
        let sunk = 1.25 - cube.position[c];
        assert!(
            sunk > 0.0 && sunk < 2.0 * shortened + 0.01 * tolerance,
            "{c}: {sunk:e}"
        );
    }
    assert!(speed < 1e-6, "{speed:e}");
    assert!(simulation.max_penetration() < 0.02 * tolerance);
    assert!(balance.residual < 1e-3, "{balance:?}");
}
