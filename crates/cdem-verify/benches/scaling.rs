//! Scaling in size and threads: a body of tetrahedra that flies free, columns of stones that
//! stand on each other, each stone one hexahedron or 27.
//!
//! `cargo bench -p cdem-verify --bench scaling` goes to a million elements and ten thousand
//! stones, `-- all` to five million and a hundred thousand (some 3 GB, and minutes), each on
//! one thread and on all. Writes `target/bench/scaling.json` too.

#![allow(clippy::print_stdout, reason = "a benchmark tells what it finds")]

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem_verify::timing::{Timed, keep, step};
use cdem_verify::{Body, Random, SEED, box_around, load, stones_of};
use serde_json::{Value, json};

/// Elements of a body, about; the last with `all` alone.
const ELEMENTS: [f64; 4] = [1e4, 1e5, 1e6, 5e6];

/// Columns along a side, each of [`STORIES`] stones; the last with `all` alone.
const COLUMNS: [usize; 3] = [10, 32, 100];
const STORIES: usize = 10;

/// Columns along a side and stories of stones of 27 elements: 500 of them.
const MESHED: (usize, usize) = (10, 5);

/// What columns are given to come to bear, steps.
const WARM_UP: u64 = 50;

fn main() -> std::io::Result<()> {
    let all = std::env::args().any(|word| word == "all");
    let sizes = |count: usize| if all { count } else { count - 1 };
    println!(
        "{:28} {:>9} {:>9} {:>8} {:>12} {:>7}",
        "what", "size", "contacts", "threads", "a second", "ratio"
    );
    let mut rows = Vec::new();
    for elements in &ELEMENTS[..sizes(ELEMENTS.len())] {
        let case = Series {
            what: "updates of a body",
            start: &|| body(*elements),
            is_enough: &|_, spent| spent > 3.0,
            rate: &|simulation, timed| (simulation.overview().elements, timed.update_rate()),
        };
        case.measure(&mut rows);
    }
    let stones = COLUMNS[..sizes(COLUMNS.len())]
        .iter()
        .map(|&along| (along, STORIES, 1));
    for (along, stories, pieces) in stones.chain([(MESHED.0, MESHED.1, 3)]) {
        let count = along * along * stories;
        let case = Series {
            what: if pieces == 1 {
                "steps of single stones"
            } else {
                "steps of meshed stones"
            },
            start: &|| columns(along, stories, pieces),
            is_enough: &|steps, spent| steps >= 20 && spent > 5.0,
            rate: &|_, timed| (count, timed.block_rate(count)),
        };
        case.measure(&mut rows);
    }
    keep("scaling", &json!(rows))
}

/// One model on one thread and on all.
struct Series<'a> {
    what: &'a str,
    start: &'a (dyn Fn() -> Simulation + Sync),
    is_enough: &'a (dyn Fn(u64, f64) -> bool + Sync),
    /// Size, and figure a second.
    rate: &'a (dyn Fn(&Simulation, &Timed) -> (usize, f64) + Sync),
}

impl Series<'_> {
    fn measure(&self, rows: &mut Vec<Value>) {
        let all = std::thread::available_parallelism().map_or(1, usize::from);
        let mut alone = None;
        for threads in if all > 1 { vec![1, all] } else { vec![1] } {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.unwrap_or_else(|error| panic!("{error}"));
            let (size, contacts, rate) = pool.install(|| {
                let mut simulation = (self.start)();
                let timed = Timed::of(&mut simulation, self.is_enough);
                let (size, rate) = (self.rate)(&simulation, &timed);
                (size, simulation.live_contacts().len(), rate)
            });
            let ratio = rate / *alone.get_or_insert(rate);
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
            }));
        }
    }
}

/// About so many tetrahedra in one body, that flies and spins a little.
fn body(elements: f64) -> Simulation {
    let mut case = load("free-flight-3d");
    let along = (elements / 6.0).cbrt().round() as usize;
    case.divide("block", &[along; 3], ElementKind::Tet4);
    case.scene.time.end = 1.0;
    case.start()
}

/// Columns of stones, wide and narrow in turn, each turned a little, that have come to bear.
fn columns(along: usize, stories: usize, pieces: usize) -> Simulation {
    let mut case = load("rocks-in-a-box");
    box_around(&mut case, [along, along, stories]);
    let mut random = Random(SEED);
    let places =
        (0..along * along * stories).map(|i| [i % along, i / along % along, i / along / along]);
    let stones: Vec<Body> = places
        .map(|place| stone(place, pieces, &mut random))
        .collect();
    let mut simulation = case.start_from(|_| stones_of(stones.iter().cloned()));
    for _ in 0..WARM_UP {
        step(&mut simulation);
    }
    simulation
}

/// A stone of a column, 1 m high.
fn stone(place: [usize; 3], pieces: usize, random: &mut Random) -> Body {
    let half = if place[2].is_multiple_of(2) {
        0.45
    } else {
        0.4
    };
    let [x, y, z] = place.map(|k| k as f64);
    let (sin, cos) = random.between(-0.05, 0.05).sin_cos();
    let corners = [0.0, 1.0].iter().flat_map(|up| {
        let around = [(-half, -half), (half, -half), (half, half), (-half, half)];
        around.map(|(a, b)| {
            [
                x + 0.5 + cos * a - sin * b,
                y + 0.5 + sin * a + cos * b,
                z + up,
            ]
        })
    });
    Body {
        kind: ElementKind::Hex8,
        corners: corners.collect(),
        pieces,
    }
}
