//! Runs of a scene at several speeds, for faults that depend on the path.

use cdem_verify::{Balance, load, run};

/// Runs a scene at its speeds, and at eleven others that are higher by a thousandth each. Returns the
/// largest rise of the energy, over the energy exchanged, and the number of contacts of the start that
/// ended.
pub(crate) fn largest_rise(scene: &str) -> (f64, usize) {
    let (mut largest, mut ended) = (0.0, 0);
    for variant in 0..12 {
        let mut case = load(scene);
        for block in &mut case.scene.block {
            let speeds = block.velocity.iter_mut();
            for speed in speeds.chain(&mut block.angular_velocity) {
                *speed *= 1.0 + 1e-3 * f64::from(variant);
            }
        }
        let mut simulation = case.start();
        let mut balance = Balance::new(&mut simulation);
        run(&mut simulation, |simulation| {
            balance.look(simulation);
            let rows = simulation.ended_contacts();
            ended += rows.iter().filter(|row| row.time_on == 0.0).count();
        });
        assert!(balance.rise.is_finite());
        largest = f64::max(largest, balance.rise);
    }
    println!("{scene}: rise of {largest:.1e}, {ended} contacts of the start ended");
    (largest, ended)
}
