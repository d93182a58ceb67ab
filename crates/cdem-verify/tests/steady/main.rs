//! What a step asks of the allocator once a run is under way.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::{Load, LoadKind, Schedule};
use cdem_verify::timing::step;
use cdem_verify::{columns, load};

/// How often each of so many steps asks for memory, on one thread.
fn requests(simulation: &mut Simulation, steps: usize) -> Vec<u64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let request = |_| allocation_counter::measure(|| step(simulation)).count_total;
    pool.expect("a pool")
        .install(|| (0..steps).map(request).collect())
}

#[test]
fn a_block_in_flight_asks_for_nothing() {
    for (kind, divisions) in [
        (ElementKind::Hex8, [1; 3]),
        (ElementKind::Tet4, [4; 3]),
        (ElementKind::Wedge6, [8; 3]),
    ] {
        let mut case = load("free-flight-3d");
        case.divide("block", &divisions, kind);
        // The first step makes room, and a look at the ledger, every 64, asks for more.
        let requests = requests(&mut case.start(), 60);
        assert!(requests[1..].iter().all(|&count| count == 0), "{kind:?}");
    }
}

#[test]
fn a_block_that_is_pressed_pulled_and_damped_asks_for_nothing() {
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
        let requests = requests(&mut case.start(), 60);
        assert!(
            requests[1..].iter().all(|&count| count == 0),
            "{requests:?}"
        );
    }
}

/// But in the steps in which contacts come and go, whose nodes are then numbered anew, and in the
/// few in which the search looks at all: less than a hundred requests a stone.
#[test]
fn stones_at_rest_ask_for_nothing_in_most_steps() {
    for (along, stories, pieces) in [(6, 4, 1), (3, 2, 3)] {
        let mut simulation = columns(along, stories, pieces);
        let requests = requests(&mut simulation, 400);
        let requests = &requests[300..];
        let quiet = requests.iter().filter(|&&count| count == 0).count();
        let stones = simulation.overview().blocks.len() as u64;
        let most = requests.iter().max();
        let is_few = most.is_some_and(|&most| most < 100 * stones);
        assert!(quiet > 50 && is_few, "{stones} stones: {requests:?}");
    }
}
