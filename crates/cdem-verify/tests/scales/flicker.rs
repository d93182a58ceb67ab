//! A contact that rests, is refined, is coarsened and rests again, many times.

use cdem_verify::{Balance, load, run};

/// Runs the brick, which lifts off and lands in each of 25 cycles, in coarse steps of `step`
/// seconds.
fn rattle(step: Option<f64>) {
    let mut case = load("rattling-brick");
    case.scene.time.step = step;
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    let mut elements = simulation.history().elements;
    let (mut changes, mut rests) = (0, 0);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        changes += u64::from(row.elements != elements);
        rests += u64::from(row.contacts > 0 && row.refined_blocks == 0);
        elements = row.elements;
    });
    let last = simulation.history();
    println!(
        "{} steps, {changes} changes of mesh, rests unrefined in {rests}; {} contacts; remesh loss \
         {:.2e} J of {:.2e} J that the plate gave, rise {:.1e}, momentum {:.1e}, residual {:.1e}",
        last.step,
        simulation.contacts_begun(),
        last.remesh_loss,
        last.external_work,
        balance.rise,
        balance.momentum,
        balance.residual,
    );
    assert!(changes > 50 && rests > 50, "{changes} {rests}");
    assert!(last.remesh_loss > 0.0);
    // Limit of the ledger for blocks that are refined at least twice.
    assert!(balance.residual < 1e-3, "{balance:?}");
    assert!(balance.rise < 1e-3 && balance.growth < 1e-3, "{balance:?}");
}

#[test]
fn a_brick_rattles() {
    rattle(None);
}

#[test]
#[ignore = "slow study: a hundred thousand steps"]
fn a_brick_rattles_for_a_hundred_thousand_steps() {
    rattle(Some(1e-5));
}
