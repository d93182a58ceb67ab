//! Resumed runs compared with runs that were never stopped: the same bits.

#![allow(clippy::print_stdout)] // what was seen is the report

use cdem::Simulation;
use cdem_verify::{Case, Random, load};

/// Advances a run by `count` steps, but not beyond its end.
fn steps(simulation: &mut Simulation, count: u64) {
    for _ in 0..count {
        if !simulation.finished() {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
    }
}

/// Resumes from the present checkpoint and compares both runs for `then` steps. In every step, all
/// data that a checkpoint saves must agree.
fn compare(case: &Case, whole: &mut Simulation, then: u64) {
    let checkpoint = whole.checkpoint();
    let resumed = case.start().resumed(&checkpoint);
    let mut resumed = resumed.unwrap_or_else(|error| panic!("{error}"));
    for step in 0..=then {
        assert_eq!(whole.step_index(), resumed.step_index());
        let is_same = whole.checkpoint() == resumed.checkpoint();
        assert!(is_same, "{step} steps after step {}", whole.step_index());
        steps(whole, 1);
        steps(&mut resumed, 1);
    }
    println!(
        "step {} of {}: {} bytes, {} contacts begun",
        whole.step_index(),
        whole.step_count(),
        checkpoint.len(),
        whole.contacts_begun()
    );
}

/// Compares `times` times, `apart` steps apart, at most until the end of the run.
fn compare_often(case: &Case, times: u32, apart: u64) {
    let mut whole = case.start();
    for _ in 0..times {
        steps(&mut whole, apart);
        compare(case, &mut whole, 40);
    }
}

/// Waves, without contact.
#[test]
fn waves_go_on() {
    compare_often(&load("wave-in-strip"), 2, 20);
}

/// Prescribed motion that begins later.
#[test]
fn a_late_platen_goes_on() {
    compare_often(&load("late-platen"), 1, 5);
}

/// Elements that keep stresses from step to step.
#[test]
fn incremental_elements_go_on() {
    let mut case = load("tumbling-block");
    for block in &mut case.scene.block {
        block.kinematics = cdem::scene::Kinematics::Incremental;
    }
    compare_often(&case, 1, 50);
}

/// Blocks that rest on each other.
#[test]
fn a_stack_goes_on() {
    compare_often(&load("stack-3d"), 2, 150);
}

/// Springs that keep their elongation.
#[test]
fn penalty_springs_go_on() {
    let mut case = load("slope");
    case.scene.contact.model = cdem::scene::ContactModel::Penalty;
    compare_often(&case, 3, 200);
}

/// Contacts that slide from face to face.
#[test]
fn an_octagon_rolls_on() {
    compare_often(&load("rolling-octagon"), 3, 400);
}

/// Joints that break, in 3-D.
#[test]
fn joints_go_on() {
    compare_often(&load("joint-3d"), 2, 120);
}

/// Resumes from every step before, during and after a two-scale impact.
#[test]
fn prisms_go_on_at_any_step_of_their_impact() {
    let case = load("two-scale-prisms");
    let mut whole = case.start();
    steps(&mut whole, 655);
    let mut kept = Vec::new();
    for _ in 0..60 {
        kept.push(whole.checkpoint());
        steps(&mut whole, 1);
    }
    assert!(whole.contacts_begun() > 0);
    for first in 0..40 {
        let resumed = case.start().resumed(&kept[first]);
        let mut resumed = resumed.unwrap_or_else(|error| panic!("{error}"));
        for (step, kept) in kept.iter().enumerate().skip(first) {
            assert!(*kept == resumed.checkpoint(), "from {first}, at {step}");
            steps(&mut resumed, 1);
        }
    }
}

/// A brick that is refined and coarsened repeatedly.
#[test]
fn a_rattling_brick_goes_on() {
    compare_often(&load("rattling-brick"), 8, 300);
}

/// Many contacts, some of them on refined blocks.
#[test]
fn a_rockfall_goes_on() {
    compare_often(&load("rockfall-of-200"), 3, 250);
}

/// Checkpoints do not depend on the number of threads: for resting contacts, also in piles, and for
/// blocks that are refined and coarsened.
#[test]
fn checkpoints_are_the_same_on_any_number_of_threads() {
    for (name, count) in [
        ("stack-3d", 100),
        ("rattling-brick", 1200),
        ("dry-stone-wall", 4),
    ] {
        let saved = [1, 2, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| {
                let mut run = load(name).start();
                let halfway = {
                    steps(&mut run, count / 2);
                    run.checkpoint()
                };
                steps(&mut run, count / 2);
                assert!(run.contacts_begun() > 0, "{name} has contacts");
                [halfway, run.checkpoint()]
            })
        });
        assert!(saved.iter().all(|of| *of == saved[0]), "{name}");
    }
}

/// A checkpoint of another run is refused, and so is a truncated one.
#[test]
fn what_is_not_of_this_run_is_refused() {
    let run = |name: &str| {
        let mut run = load(name).start();
        steps(&mut run, 30);
        run.checkpoint()
    };
    let start = || load("stack-3d").start();
    for name in ["rattling-brick", "rolling-3d", "free-flight-3d", "pavement"] {
        assert!(start().resumed(&run(name)).is_err(), "{name}");
    }
    let own = run("stack-3d");
    assert!(start().resumed(&own).is_ok());
    for share in 0..20 {
        assert!(start().resumed(&own[..share * own.len() / 20]).is_err());
    }
}

/// Changed bytes may give another state or an error; they never panic.
#[test]
fn changed_bytes_end_no_program() {
    let mut random = Random(11);
    for name in ["two-scale-prisms", "stack"] {
        let case = load(name);
        let mut run = case.start();
        steps(&mut run, if name == "stack" { 60 } else { 680 });
        let kept = run.checkpoint();
        let mut refused = 0;
        for _ in 0..300 {
            let mut bytes = kept.clone();
            for _ in 0..random.whole(1, 3) {
                let place = random.whole(0, bytes.len() - 1);
                bytes[place] = random.whole(0, 255) as u8;
            }
            refused += u32::from(case.start().resumed(&bytes).is_err());
        }
        println!("{name}: {refused} of 300 refused, {} bytes", kept.len());
        assert!(refused > 0);
    }
}
