//! Results do not depend on the number of threads.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::output::FieldValues;
use cdem::scene::{Damping, Load, LoadKind, Schedule};
use cdem_verify::{columns, load};

/// Returns all output of a run after `steps` steps. Floating-point numbers are written as the
/// shortest text that restores them.
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
    for threads in [2, 7] {
        assert!(told(threads, steps, &start) == alone, "{threads} threads");
    }
}

#[test]
fn a_pile_gives_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(3, || load("dry-stone-wall").start());
}

/// Many islands are solved at once, and their pairs touch in the middle of many drifts.
#[test]
fn piles_beside_each_other_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(30, || columns(3, 2, 1));
    // More nodes than one thread takes at a time.
    assert_same_bits(2, || columns(5, 3, 3));
}

#[test]
#[ignore = "slow study: larger piles"]
fn larger_piles_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(60, || columns(5, 3, 1));
    assert_same_bits(60, || columns(3, 2, 3));
    assert_same_bits(6, || columns(5, 3, 3));
}

/// Cells along each edge of a falling block: more nodes than one thread takes at a time.
const CELLS: usize = 18;

/// Builds that block, and a small one with steps four times as fine, above a fixed block of `cells`
/// cells along each edge, which lies between them in the node order. If `is_damped`, there are also
/// gravity, a load and all kinds of damping.
fn above_fixed(cells: usize, is_damped: bool) -> Simulation {
    let mut case = load("free-flight-3d");
    let mut pebble = case.scene.block[0].clone();
    (pebble.name, pebble.scale) = ("pebble".into(), 0.25);
    pebble.translate = vec![0.0, 0.0, 5.0];
    let mut floor = case.scene.block[0].clone();
    (floor.name, floor.fixed) = ("floor".into(), true);
    floor.translate = vec![0.0, 0.0, -5.0];
    (floor.velocity, floor.angular_velocity) = (vec![0.0; 3], vec![0.0; 3]);
    case.scene.block.extend([floor, pebble]);
    for (name, cells) in [("block", CELLS), ("pebble", CELLS), ("floor", cells)] {
        case.divide(name, &[cells; 3], ElementKind::Hex8);
    }
    if is_damped {
        case.scene.gravity = Schedule::Constant(vec![0.0, 0.0, -9.81]);
        case.scene.material[0].damping = Damping {
            mass: 5.0,
            stiffness: 1e-6,
            local: 0.1,
        };
        case.scene.load = vec![Load {
            group: "block.xmin".into(),
            kind: LoadKind::Traction(Schedule::Constant(vec![1e4, 0.0, 0.0])),
            start: 0.0,
            end: None,
        }];
    }
    case.start()
}

#[test]
fn blocks_of_several_levels_above_a_fixed_one_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits(2, || above_fixed(5, true));
}

#[test]
#[ignore = "slow study: with and without damping"]
fn damped_and_free_blocks_of_several_levels_give_the_same_bits_on_any_number_of_threads() {
    for is_damped in [false, true] {
        assert_same_bits(8, || above_fixed(5, is_damped));
    }
}

/// A fixed block leaves a gap in the rows of moving nodes. With another size, elements are grouped
/// differently and forces are summed in another order. Positions may then differ by some roundings
/// of the displacement of each step, and energies by some roundings of their sum.
#[test]
fn what_is_fixed_stays_and_changes_nothing_however_large_it_is() {
    for is_damped in [false, true] {
        let frames = [5, 30].map(|cells| {
            let mut simulation = above_fixed(cells, is_damped);
            let before = simulation.frame();
            (0..3).for_each(|_| simulation.step().expect("a step"));
            (before, simulation.frame(), simulation.history())
        });
        // The moving nodes lie on both sides of the fixed ones.
        let own = (CELLS + 1).pow(3);
        let are_close = |one: &[[f64; 3]], other: &[[f64; 3]]| {
            let mut both = one.as_flattened().iter().zip(other.as_flattened());
            one.len() == other.len() && both.all(|(a, b)| (a - b).abs() <= 1e-14)
        };
        let parts = |points: &[[f64; 3]]| {
            let end = points.len() - own;
            [0..own, own..end, end..points.len()].map(|part| points[part].to_vec())
        };
        let [block, _, pebble] = parts(&frames[0].1.points);
        for (before, after, history) in &frames {
            let first = &frames[0].2;
            let energies = [first, history].map(|row| row.kinetic_energy + row.strain_energy);
            assert!((energies[0] - energies[1]).abs() <= 1e-14 * energies[0]);
            assert_eq!(
                [first.contacts, first.refined_blocks],
                [history.contacts, history.refined_blocks]
            );
            let [start, end] = [before, after].map(|frame| parts(&frame.points));
            assert_eq!(start[1], end[1]);
            assert!(are_close(&block, &end[0]) && are_close(&pebble, &end[2]));
            assert!(start[0] != end[0] && start[2] != end[2]);
            let mut fields = after.cell_fields.iter();
            let levels = fields.find(|field| field.name == "level");
            let FieldValues::Whole(levels) = &levels.expect("levels").values else {
                panic!("levels are whole numbers");
            };
            assert!([0, 2].iter().all(|level| levels.contains(level)));
        }
    }
}
