//! The number of threads is no part of the physics.

use cdem::Simulation;
use cdem_verify::{columns, load};

/// All that a run says of itself after so many steps: floating-point numbers in the shortest text
/// that gives them back.
fn told(threads: usize, steps: u64, start: impl Fn() -> Simulation + Sync) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a pool of threads").install(|| {
        let mut simulation = start();
        let mut told = String::new();
        for _ in 0..steps {
            simulation.step().expect("a step");
            told += &format!("{:?}\n", simulation.history());
        }
        told += &format!("{:?}", simulation.live_contacts());
        told + &format!("{:?} {:?}", simulation.frame(), simulation.checkpoint())
    })
}

fn assert_same_bits(steps: u64, start: impl Fn() -> Simulation + Sync) {
    let alone = told(1, steps, &start);
    for threads in [2, 3, 7] {
        assert!(told(threads, steps, &start) == alone, "{threads} threads");
    }
}

#[test]
fn a_pile_gives_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(6, || load("dry-stone-wall").start());
}

/// Islands that are held many at once, and whose pairs touch in the middle of many drifts.
#[test]
fn piles_beside_each_other_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(60, || columns(5, 3, 1));
    assert_same_bits(60, || columns(3, 2, 3));
}
