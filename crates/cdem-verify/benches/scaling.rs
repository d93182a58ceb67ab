//! Scaling with size and threads: a free tetrahedral body, and columns of stones with one or 27
//! hexahedra per stone.
//!
//! `cargo bench -p cdem-verify --bench scaling` goes to a million elements and ten thousand stones;
//! `-- all` to five million and a hundred thousand (some 3 GB, and minutes). Each case runs on one
//! thread and on all. `-- stones` omits the bodies; `-- meshed` runs only the stones of 27
//! elements. It writes `target/bench/scaling.json`, with the time fraction of each stage.

#![allow(clippy::print_stdout, reason = "a benchmark tells what it finds")]

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem_verify::timing::{Asked, Timed, keep, step};
use cdem_verify::{columns, load};
use serde_json::{Value, json};

/// Approximate element numbers of the body; the last one with `all` only.
const ELEMENTS: [f64; 4] = [1e4, 1e5, 1e6, 5e6];

/// Columns along a side, each of [`STORIES`] stones, and the number of timed steps; the last one
/// with `all` only. A time limit would stop different programs at different states, with more or
/// fewer impacts.
const COLUMNS: [(usize, u64); 3] = [(10, 200), (32, 20), (100, 20)];
const STORIES: usize = 10;

/// Columns along a side, stories, and timed steps of stones of 27 elements: 500 stones.
const MESHED: (usize, usize, u64) = (10, 5, 40);

/// Steps before the timing, in which the columns take up their load.
const WARM_UP: u64 = 50;

fn main() -> std::io::Result<()> {
    let asked = Asked::of_command(&["all", "stones", "meshed"])?;
    let has = |wanted: &str| asked.has(wanted);
    let all = has("all");
    let sizes = |count: usize| if all { count } else { count - 1 };
    println!(
        "{:28} {:>9} {:>9} {:>8} {:>12} {:>7}",
        "what", "size", "contacts", "threads", "a second", "ratio"
    );
    let mut rows = Vec::new();
    let (meshed, stones) = (has("meshed"), has("stones"));
    let bodies = if stones || meshed {
        0
    } else {
        sizes(ELEMENTS.len())
    };
    for elements in &ELEMENTS[..bodies] {
        let case = Series {
            what: "updates of a body",
            start: &|| body(*elements),
            is_enough: &|_, spent| spent > 3.0,
            rate: &|simulation, timed| (simulation.overview().elements, timed.update_rate()),
        };
        case.measure(&mut rows);
    }
    let single = if meshed { 0 } else { sizes(COLUMNS.len()) };
    let single = COLUMNS[..single]
        .iter()
        .map(|&(along, steps)| (along, STORIES, 1, steps));
    let (along, stories, steps) = MESHED;
    for (along, stories, pieces, wanted) in single.chain([(along, stories, 3, steps)]) {
        let count = along * along * stories;
        let case = Series {
            what: if pieces == 1 {
                "steps of single stones"
            } else {
                "steps of meshed stones"
            },
            start: &|| standing(along, stories, pieces),
            is_enough: &|steps, _| steps >= wanted,
            rate: &|_, timed| (count, timed.block_rate(count)),
        };
        case.measure(&mut rows);
    }
    keep("scaling", &json!(rows))
}

/// One model, timed on one thread and on all.
struct Series<'a> {
    what: &'a str,
    start: &'a (dyn Fn() -> Simulation + Sync),
    is_enough: &'a (dyn Fn(u64, f64) -> bool + Sync),
    /// Size, and rate per second.
    rate: &'a (dyn Fn(&Simulation, &Timed) -> (usize, f64) + Sync),
}

impl Series<'_> {
    fn measure(&self, rows: &mut Vec<Value>) {
        let all = std::thread::available_parallelism().map_or(1, usize::from);
        let mut alone: Option<(u64, f64)> = None;
        for threads in if all > 1 { vec![1, all] } else { vec![1] } {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.unwrap_or_else(|error| panic!("{error}"));
            let (size, contacts, rate, timed) = pool.install(|| {
                let mut simulation = (self.start)();
                // All thread counts take the same steps, because other steps may have other
                // impacts.
                let timed = Timed::in_stages(&mut simulation, |steps, spent| match alone {
                    Some((wanted, _)) => steps >= wanted,
                    None => (self.is_enough)(steps, spent),
                });
                let (size, rate) = (self.rate)(&simulation, &timed);
                let contacts = simulation.live_contacts().len();
                (size, contacts, rate, timed)
            });
            let ratio = rate / alone.get_or_insert((timed.steps, rate)).1;
            println!(
                "{:28} {size:9} {contacts:9} {threads:8} {rate:12.3e} {ratio:7.2}",
                self.what
            );
            rows.push(json!({
                "what": self.what,
                "size": size,
                "contacts": contacts,
                "threads": threads,
                "per_second": rate,
                "over_one_thread": ratio,
                "share_of_stages": timed.shares(),
            }));
        }
    }
}

/// Builds a body of about `elements` tetrahedra that flies and spins slowly.
fn body(elements: f64) -> Simulation {
    let mut case = load("free-flight-3d");
    let along = (elements / 6.0).cbrt().round() as usize;
    case.divide("block", &[along; 3], ElementKind::Tet4);
    case.scene.time.end = 1.0;
    case.start()
}

/// Builds columns of stones that carry their load.
fn standing(along: usize, stories: usize, pieces: usize) -> Simulation {
    let mut simulation = columns(along, stories, pieces);
    for _ in 0..WARM_UP {
        step(&mut simulation);
    }
    simulation
}
