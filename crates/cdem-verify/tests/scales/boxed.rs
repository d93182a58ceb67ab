//! Boxes that bounce about between walls, for long: refined and coarsened again and again.

use cdem_verify::{Balance, load, run};

/// Energy never comes above what it was at the start, nor by more than `rise` of that above
/// its least so far: where a change of time levels gives what others before it have taken.
fn bounce(end: f64, changes: u64) {
    let mut case = load("bouncing-boxes");
    case.scene.time.end = end;
    let boxes = case.scene.block.iter().filter(|b| !b.fixed).count() as f64;
    let mut simulation = case.start();
    let start = simulation.history();
    let mut balance = Balance::new(&mut simulation);
    let (mut last, mut changed) = (start, 0);
    let (mut contacts, mut exchanged) = (0, 0.0);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        let energy = row.kinetic_energy + row.strain_energy;
        assert!(
            energy < start.kinetic_energy * (1.0 + 1e-12),
            "{energy:e} {row:?}"
        );
        changed += u64::from(row.elements != last.elements);
        // What one box has of it, at each touch.
        exchanged += (simulation.contacts_begun() - contacts) as f64 * energy / boxes;
        contacts = simulation.contacts_begun();
        last = row;
    });
    let of_start = |energy: f64| energy / start.kinetic_energy;
    println!(
        "{} steps, {contacts} contacts, {changed} changes of mesh; of the energy {:.3} left, {:.3} \
         lost in impacts, {:.3} in changes of mesh, rise {:.1e}; momentum {:.1e}; residual {:.1e} \
         of the energy, {:.1e} of what boxes had as they touched",
        last.step,
        of_start(last.kinetic_energy + last.strain_energy),
        of_start(last.impact_loss),
        of_start(last.remesh_loss),
        balance.rise,
        balance.momentum,
        of_start(last.energy_residual),
        last.energy_residual / exchanged,
    );
    assert!(changed > changes, "{changed}");
    // 1e-11 over 3e7 substeps, 1e-3 of what is exchanged: design, section 7.
    assert!(balance.momentum < 1e-11, "{balance:?}");
    assert!(last.energy_residual.abs() < 1e-3 * exchanged);
    // What is banked is less than what one touch may lose, `energy_loss`.
    assert!(balance.rise < 1e-2, "{balance:?}");
}

#[test]
fn boxes_bounce_in_a_box() {
    bounce(2.0, 50);
}

#[test]
#[ignore = "slow study: a million coarse steps"]
fn boxes_bounce_for_a_million_steps() {
    bounce(66.0, 900);
}
