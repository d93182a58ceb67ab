//! A block at rest is no longer refined.

use cdem_verify::{Balance, load, run};

/// Time at the end in which the block must be at rest, s.
const LIES: f64 = 0.05;

#[test]
fn a_dropped_block_lies_as_one_element() {
    let case = load("dropped-block");
    let mut simulation = case.start();
    let start = simulation.history().elements;
    let mut balance = Balance::new(&mut simulation);
    let weight = 9.81 * simulation.block_rows()[1].mass;
    let end = case.scene.time.end;
    let (mut most, mut energy, mut borne) = (0, 0.0_f64, Vec::new());
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        most = most.max(row.elements);
        let pushed = simulation.block_rows()[1].force[1];
        if simulation.time() > end - LIES {
            assert_eq!(row.elements, start, "{row:?}");
            energy = energy.max(row.kinetic_energy.abs() / row.gravity_work);
            borne.push(pushed / weight);
        }
    });
    let off = borne.iter().map(|share| (share - 1.0).abs());
    let off = off.fold(0.0, f64::max);
    println!(
        "{most} elements at most, then {start}; kinetic energy {energy:.1e} of gravity's work, \
         force over weight off by {off:.1e}; {balance:?}"
    );
    assert!(most > start);
    // Damping never takes the motion to zero. The limits are 1e-6 of the speed of the fall, and of
    // the weight.
    assert!(energy < 1e-12, "{energy:e}");
    assert!(off < 1e-6, "{off:e}");
    // Limit of the ledger for blocks of one element.
    assert!(balance.residual < 2e-2, "{balance:?}");
}
