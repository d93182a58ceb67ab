//! Many first touches at once, and first touches that no earlier motion predicts.

use cdem::scene::Schedule;
use cdem_verify::{Balance, Case, deepest_overlap, load, run};

/// Runs a scene. Returns the balance, the deepest overlap over the tolerance, and the number of
/// contacts begun.
pub(crate) fn meet(case: &Case) -> (Balance, f64, u64) {
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    let mut overlap = 0.0_f64;
    run(&mut simulation, |simulation| {
        balance.look(simulation);
        overlap = overlap.max(deepest_overlap(&simulation.frame()));
    });
    let tolerance = simulation.scene().contact.tolerance.expect("filled in");
    let begun = simulation.contacts_begun();
    println!("{begun} contacts begun, overlap {overlap:e}; {balance:?}");
    (balance, overlap / tolerance, begun)
}

#[test]
fn four_hundred_points_that_touch_in_a_few_steps_are_all_found() {
    let (balance, overlap, begun) = meet(&load("tilted-bar"));
    assert!(begun >= 401, "each node of the bar's lower face: {begun}");
    assert!(overlap <= 1.0, "{overlap}");
    assert!(balance.residual < 1e-3, "{balance:?}"); // limit of the ledger
}

#[test]
fn a_platen_that_starts_late_is_found_in_its_first_step() {
    let table = Schedule::Table(vec![(0.0, 0.0), (1e-4, 10.0)]);
    for late in [true, false] {
        let mut case = load("late-platen");
        if !late {
            let boundary = &mut case.scene.boundary[0];
            boundary.start = 0.0;
            boundary.motion = cdem::scene::Motion::Velocity([
                Some(table.clone()),
                Some(Schedule::Constant(0.0)),
                None,
            ]);
        }
        let (balance, overlap, begun) = meet(&case);
        assert!(begun > 0);
        assert!(overlap <= 1.0, "{overlap}");
        assert!(balance.residual < 1e-3, "{balance:?}");
    }
}

#[test]
fn what_is_lifted_lets_go() {
    let case = load("lifted-stone");
    let mut simulation = case.start();
    run(&mut simulation, |_| {});
    let end = simulation.history();
    assert_eq!(end.contacts, 0);
    // Work to lift 432 kg by 0.1 m and to set it in motion: 477.8 J.
    assert!(end.impact_loss.abs() < 1e-3 * end.external_work, "{end:?}");
    let exact = 432.0 * (9.81 * 0.1 + 0.5 * 0.25);
    assert!((end.external_work / exact - 1.0).abs() < 1e-2, "{end:?}");
}

#[test]
fn bricks_that_touch_under_stress_lose_what_is_booked() {
    let (balance, overlap, _) = meet(&load("brick-drop"));
    // Limit of the ledger for blocks of one element.
    assert!(balance.residual < 2e-2, "{balance:?}");
    assert!(overlap <= 1.0, "{overlap}");
}

#[test]
fn how_often_one_looks_changes_nothing() {
    let last = |every: u64| {
        let mut simulation = load("late-platen").start();
        while !simulation.finished() {
            simulation.step().expect("it is stable");
            if simulation.step_index().is_multiple_of(every) {
                simulation.history();
            }
        }
        simulation.history()
    };
    assert_eq!(last(1), last(1000));
}
