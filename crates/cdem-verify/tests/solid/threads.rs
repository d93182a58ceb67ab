//! The number of threads is no part of the physics.

use cdem::Simulation;
use cdem_verify::{columns, load};

/// All that a run says of itself after some steps: floating-point numbers in the shortest text
/// that gives them back.
fn told(threads: usize, start: impl Fn() -> Simulation + Sync) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a pool of threads").install(|| {
        let mut simulation = start();
        let mut told = String::new();
        for _ in 0..6 {
            simulation.step().expect("a step");
            told += &format!("{:?}\n", simulation.history());
        }
        told += &format!("{:?}", simulation.live_contacts());
        told + &format!("{:?} {:?}", simulation.frame(), simulation.checkpoint())
    })
}

fn assert_same_bits(start: impl Fn() -> Simulation + Sync) {
    let alone = told(1, &start);
    for threads in [2, 3, 7] {
        assert!(told(threads, &start) == alone, "{threads} threads");
    }
}

#[test]
fn a_pile_gives_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(|| load("dry-stone-wall").start());
}

/// Islands of contacts that are held many at once.
#[test]
fn piles_beside_each_other_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(|| columns(5, 3, 1));
    assert_same_bits(|| columns(3, 2, 2));
}
