//! The number of threads is no part of the physics.

use cdem_verify::load;

/// All that a run of a pile says of itself after some steps: floating-point numbers
/// in the shortest text that gives them back.
fn told(threads: usize) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a pool of threads").install(|| {
        let mut simulation = load("dry-stone-wall").start();
        let mut told = String::new();
        for _ in 0..6 {
            simulation.step().expect("a step");
            told += &format!("{:?}\n", simulation.history());
        }
        told += &format!("{:?}", simulation.live_contacts());
        told + &format!("{:?} {:?}", simulation.frame(), simulation.checkpoint())
    })
}

#[test]
fn a_pile_gives_the_same_bits_on_any_number_of_threads() {
    let alone = told(1);
    for threads in [2, 3, 7] {
        assert!(told(threads) == alone, "{threads} threads");
    }
}
