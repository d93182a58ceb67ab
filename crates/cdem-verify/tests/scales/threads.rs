//! Results of two-scale runs do not depend on the number of threads.

use cdem::scene::ContactModel;
use cdem_verify::load;

/// Returns all output of a run until its mesh has changed `changes` times, and the number of steps.
/// Floating-point numbers are written as the shortest text that restores them.
fn told(scene: &str, threads: usize, changes: u32) -> (String, u64) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a pool of threads").install(|| {
        let mut case = load(scene);
        case.scene.contact.model = ContactModel::TwoScale;
        let mut simulation = case.start();
        let mut told = String::new();
        let (mut elements, mut changed) = (simulation.history().elements, 0);
        while changed < changes && !simulation.finished() {
            simulation.step().expect("a step");
            let row = simulation.history();
            changed += u32::from(row.elements != elements);
            elements = row.elements;
            told += &format!("{row:?}\n");
        }
        assert_eq!(changed, changes, "{scene}: the mesh has changed");
        told += &format!("{:?}", simulation.ended_contacts());
        told += &format!("{:?}", simulation.live_contacts());
        told += &format!("{:?}", simulation.frame());
        told += &format!("{:?}", simulation.checkpoint());
        (told, simulation.step_index())
    })
}

/// Checks that a run until its mesh has changed `changes` times gives the same bits on these numbers
/// of threads as on one.
fn assert_same_bits(scene: &str, changes: u32, threads: &[usize]) {
    let alone = told(scene, 1, changes);
    println!("{scene}: {changes} changes of mesh in {} steps", alone.1);
    for &threads in threads {
        assert!(
            told(scene, threads, changes) == alone,
            "{scene}: {threads} threads"
        );
    }
}

#[test]
fn changes_of_mesh_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits("bouncing-boxes", 4, &[2, 7]);
}

#[test]
#[ignore = "slow study: 200 rocks, and more changes of mesh"]
fn changes_of_a_large_mesh_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits("bouncing-boxes", 8, &[2, 3, 7]);
    assert_same_bits("rockfall-of-200", 3, &[2, 3, 7]);
}
