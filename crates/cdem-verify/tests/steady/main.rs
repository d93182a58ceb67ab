//! Memory requests per step of a run under way: none, on one thread or two, except when contacts
//! begin or end, when the broad phase is rebuilt, and when the ledger is evaluated.

use std::alloc::System;
use std::sync::{Mutex, MutexGuard, PoisonError};

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::output::ContactRow;
use cdem::scene::{Load, LoadKind, Schedule};
use cdem_verify::timing::step;
use cdem_verify::{columns, example, load};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Coarse steps between two evaluations of elements and ledger, which request memory.
const LOOK: usize = 64;

/// Steps of a run with contacts until they all have begun, and then with requests counted.
const STEPS: [usize; 2] = [300, 200];

/// Fraction of steps that counts as few.
const FEW: f64 = 0.1;

/// Memory requests of a step.
struct Asked {
    /// Number of requests on all threads.
    requests: usize,
    /// True if the contacts are the same before and after the step.
    is_steady: bool,
}

/// Lets one test at a time count, because all threads of the process are counted.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the requests of each of `steps` steps on `threads` threads, after `first` steps. Steps
/// that evaluate the ledger are left out.
fn asked(simulation: &mut Simulation, threads: usize, [first, steps]: [usize; 2]) -> Vec<Asked> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a pool").install(|| {
        (0..first).for_each(|_| step(simulation));
        let ask = |number: usize| {
            let before = contacts(simulation);
            let region = Region::new(ALLOCATOR);
            step(simulation);
            let change = region.change();
            let asked = Asked {
                requests: change.allocations + change.reallocations,
                is_steady: contacts(simulation) == before,
            };
            (!number.is_multiple_of(LOOK)).then_some(asked)
        };
        (first + 1..=first + steps).filter_map(ask).collect()
    })
}

/// Returns the contacts by blocks and start time.
fn contacts(simulation: &Simulation) -> Vec<(String, String, f64)> {
    let contacts = simulation.live_contacts().into_iter();
    let of = |row: ContactRow| (row.main, row.target, row.time_on);
    contacts.map(of).collect()
}

/// Asserts that at most the fraction `few` of the steady steps request memory. With several threads
/// a tenth may, because each thread makes room when it first takes part in a task.
fn assert_rare(name: &str, threads: usize, asked: &[Asked], few: f64) {
    let steady = asked.iter().filter(|asked| asked.is_steady);
    let requests = steady.clone().map(|asked| asked.requests);
    let requests: Vec<usize> = requests.filter(|&count| count > 0).collect();
    let (steady, few) = (steady.count(), if threads > 1 { FEW } else { few });
    assert!(
        2 * steady > asked.len() && requests.len() as f64 <= few * steady as f64,
        "{name}, {threads} threads: in {} of {steady} steps: {requests:?}",
        requests.len()
    );
}

#[test]
fn a_block_in_flight_asks_for_nothing() {
    let _alone = alone();
    for (kind, divisions) in [
        (ElementKind::Hex8, [1; 3]),
        (ElementKind::Tet4, [4; 3]),
        (ElementKind::Wedge6, [8; 3]),
        // These run on all threads.
        (ElementKind::Tet4, [16; 3]),
        (ElementKind::Hex8, [16; 3]),
    ] {
        for threads in [1, 2] {
            let mut case = load("free-flight-3d");
            case.divide("block", &divisions, kind);
            let asked = asked(&mut case.start(), threads, [1, 60]);
            assert_rare(&format!("{kind:?}"), threads, &asked, 0.0);
        }
    }
}

#[test]
fn a_block_that_is_pressed_pulled_and_damped_asks_for_nothing() {
    let _alone = alone();
    for name in ["loaded-block", "loaded-block-3d"] {
        let mut case = load(name);
        let along = vec![4; case.scene.dimension];
        case.scene.gravity = Schedule::Constant(vec![-9.81; case.scene.dimension]);
        case.scene.material[0].damping.mass = 1.0;
        let kind = match case.scene.dimension {
            2 => ElementKind::Tri3,
            _ => ElementKind::Hex8,
        };
        case.divide("block", &along, kind);
        let pull = case.scene.load[0].clone();
        case.scene.load.push(Load {
            kind: LoadKind::Pressure(Schedule::Constant(1e3)),
            ..pull
        });
        let asked = asked(&mut case.start(), 1, [1, 60]);
        assert_rare(name, 1, &asked, 0.0);
    }
}

/// A few steps may request memory: the broad phase is rebuilt, pairs close that an existing contact
/// already represents, or more data are kept at once than ever before.
#[test]
fn contacts_that_stay_ask_for_nothing() {
    let _alone = alone();
    for threads in [1, 2] {
        let scenes = [
            ("pressed-blocks", load("pressed-blocks").start(), 0.0),
            ("rolling-3d", load("rolling-3d").start(), 0.0),
            ("slope", load("slope").start(), FEW),
            ("slope-3d", load("slope-3d").start(), FEW),
            ("bars-2d", example("bars-2d").start(), FEW),
            ("slope-2d", example("slope-2d").start(), 0.0),
            ("stones", columns(3, 3, 1), FEW),
            ("meshed stones", columns(2, 2, 3), 0.0),
        ];
        for (name, mut simulation, few) in scenes {
            let asked = asked(&mut simulation, threads, STEPS);
            assert_rare(name, threads, &asked, few);
        }
    }
}
