//! What a step asks of the allocator once a run is under way: nothing, on one thread or two, but
//! where contacts come or go, where the search begins anew, and at each look at the ledger.

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

/// Coarse steps from one look at elements and ledger, which asks for memory, to the next.
const LOOK: usize = 64;

/// Share of steps that is a few.
const FEW: f64 = 0.1;

/// What a step has asked for.
struct Asked {
    /// How often, on all threads.
    requests: usize,
    /// Whether all contacts before it were there after it, and no others.
    is_steady: bool,
}

/// Has one test at a time count: all threads of the process are counted.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What each of some steps asks for on so many threads, after some first ones; those with a look
/// at the ledger are left out.
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

/// The contacts there are, by blocks and beginnings.
fn contacts(simulation: &Simulation) -> Vec<(String, String, f64)> {
    let contacts = simulation.live_contacts().into_iter();
    let of = |row: ContactRow| (row.main, row.target, row.time_on);
    contacts.map(of).collect()
}

/// Asserts that no more than the share `few` of the steady steps ask for anything;
/// on more than one thread a tenth may, as each makes room when it first helps with something.
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
        // On all threads.
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

/// But for a few steps: in which the search begins anew, pairs touch that turn out to say what a
/// contact says already, or there is more to be kept at once than there has ever been.
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
            ("stones", columns(6, 4, 1), FEW),
            ("meshed stones", columns(3, 2, 3), 0.0),
        ];
        for (name, mut simulation, few) in scenes {
            let asked = asked(&mut simulation, threads, [300, 200]);
            assert_rare(name, threads, &asked, few);
        }
    }
}
