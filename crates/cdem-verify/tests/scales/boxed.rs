//! Boxes that bounce between walls for a long time; they are refined and coarsened repeatedly.

use std::collections::BTreeSet;

use cdem::Simulation;
use cdem_verify::{Balance, load, run};

/// Returns the pairs of blocks in contact, sorted.
fn pairs(simulation: &Simulation) -> BTreeSet<[String; 2]> {
    let live = simulation.live_contacts().into_iter();
    live.map(|contact| {
        let mut pair = [contact.main, contact.target];
        pair.sort();
        pair
    })
    .collect()
}

/// The energy never exceeds that at the start. While no box is refined or in contact, it does not
/// exceed its value of the last such time. In between, a change of mesh may add energy for a while,
/// if the box has no motion from which it can be taken at once.
fn bounce(end: f64, changes: u64) {
    let mut case = load("bouncing-boxes");
    case.scene.time.end = end;
    let boxes = case.scene.block.iter().filter(|b| !b.fixed).count() as f64;
    let mut simulation = case.start();
    let start = simulation.history();
    let mut balance = Balance::new(&mut simulation);
    let (mut last, mut changed) = (start, 0);
    let (mut touching, mut impacts, mut exchanged) = (BTreeSet::new(), 0, 0.0);
    let (mut quiet, mut raised) = (start.kinetic_energy, 0.0_f64);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        let energy = row.kinetic_energy + row.strain_energy;
        assert!(
            energy < start.kinetic_energy * (1.0 + 1e-12),
            "{energy:e} {row:?}"
        );
        if row.elements == start.elements && row.contacts == 0 {
            raised = raised.max(energy - quiet);
            quiet = quiet.min(energy);
        }
        changed += u64::from(row.elements != last.elements);
        // Energy per box, once for each new contact between two boxes.
        let now = pairs(simulation);
        let begun = now.difference(&touching).count();
        exchanged += begun as f64 * energy / boxes;
        impacts += begun;
        touching = now;
        last = row;
    });
    let of_start = |energy: f64| energy / start.kinetic_energy;
    println!(
        "{} steps, {impacts} impacts, {changed} changes of mesh; of the energy {:.3} left, {:.3} \
         lost in impacts, {:.3} in changes of mesh, rise {:.1e}, in flight {:.1e}; momentum {:.1e}; residual {:.1e} \
         of the energy, {:.1e} of what boxes had as they touched",
        last.step,
        of_start(last.kinetic_energy + last.strain_energy),
        of_start(last.impact_loss),
        of_start(last.remesh_loss),
        balance.rise,
        of_start(raised),
        balance.momentum,
        of_start(last.energy_residual),
        last.energy_residual / exchanged,
    );
    assert!(changed > changes, "{changed}");
    // 1e-11 over 3e7 substeps; the residual may be 1e-3 of the energy exchanged.
    assert!(balance.momentum < 1e-11, "{balance:?}");
    assert!(last.energy_residual.abs() < 1e-3 * exchanged);
    // The temporary gain by a change of mesh is at most the tolerance of the ledger.
    assert!(balance.rise < 1e-3, "{balance:?}");
    // St Venant-Kirchhoff strain energy is not quadratic. ½v⁻·M·v⁺ + U of vibrating boxes
    // oscillates by the strain, (v/c)/2 = 1e-3, times the energy of the vibration, a twentieth.
    assert!(raised < 5e-5 * start.kinetic_energy, "{raised:e}");
}

#[test]
fn boxes_bounce_in_a_box() {
    bounce(2.0, 50);
}

#[test]
#[ignore = "slow study: a million coarse steps"]
fn boxes_bounce_for_a_million_steps() {
    bounce(66.0, 2000);
}
