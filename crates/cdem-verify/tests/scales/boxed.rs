//! Boxes that bounce about between walls, for long: refined and coarsened again and again.

use std::collections::BTreeSet;

use cdem::Simulation;
use cdem_verify::{Balance, load, run};

/// Pairs of blocks that touch, sorted.
fn pairs(simulation: &Simulation) -> BTreeSet<[String; 2]> {
    let live = simulation.live_contacts().into_iter();
    live.map(|contact| {
        let mut pair = [contact.main, contact.target];
        pair.sort();
        pair
    })
    .collect()
}

/// Energy is never above that of the start. Where no box is refined and none touches, it is
/// not above what it was the last time that this was so; in between a change of mesh may
/// make some that a box has no motion to pay for at once.
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
        // What one box has of it, each time that two come to touch.
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
    // 1e-11 over 3e7 substeps, 1e-3 of what is exchanged: design, section 7.
    assert!(balance.momentum < 1e-11, "{balance:?}");
    assert!(last.energy_residual.abs() < 1e-3 * exchanged);
    // What a change of mesh may make for a while is no more than what the ledger may lack.
    assert!(balance.rise < 1e-3, "{balance:?}");
    // St Venant-Kirchhoff is not quadratic: ½v⁻·M·v⁺ + U of boxes that vibrate goes up and
    // down by the strain, (v/c)/2 = 1e-3, times what is in the vibration, a twentieth.
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
