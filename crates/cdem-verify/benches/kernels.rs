//! Elements in free flight: what the kernels of all shapes take, beside what the machine's
//! memory gives in the same run.
//!
//! `cargo bench -p cdem-verify --bench kernels` takes about 200 000 elements of each shape,
//! `-- 1e6` a million, `-- tet4 tri3` these shapes alone. On `RAYON_NUM_THREADS` threads.
//! Writes `target/bench/kernels.json` too.

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a benchmark tells what the clock says"
)]

use std::hint::black_box;
use std::time::Instant;

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::Kinematics;
use cdem_verify::timing::{Asked, TRIALS, free_block, keep, seconds_of_an_update};
use rayon::prelude::*;
use serde_json::json;

/// Numbers of each array of the triad: more than caches hold.
const TRIAD: usize = 16 << 20;

/// A shape, its Gauss points, and elements that a cell of a box is cut into.
const SHAPES: [(ElementKind, usize, usize); 5] = [
    (ElementKind::Tri3, 1, 2),
    (ElementKind::Quad4, 4, 1),
    (ElementKind::Tet4, 1, 6),
    (ElementKind::Wedge6, 6, 2),
    (ElementKind::Hex8, 8, 1),
];

fn main() -> std::io::Result<()> {
    let asked = Asked::of_command(&SHAPES.map(|(kind, ..)| kind.name()))?;
    let wanted = asked.numbers.last().copied().unwrap_or(2e5);
    let triad = triad();
    let threads = rayon::current_num_threads();
    println!("{threads} threads; triad {:.1} GB/s", triad / 1e9);
    println!(
        "{:8} {:12} {:>9} {:>8} {:>11} {:>10} {:>7} {:>9} {:>16}",
        "shape",
        "kinematics",
        "elements",
        "ns",
        "million/s",
        "bytes each",
        "GB/s",
        "of triad",
        "steps, million/s"
    );
    let mut rows = Vec::new();
    for (kind, points, pieces) in SHAPES {
        if !asked.wants(kind.name()) {
            continue;
        }
        for (kinematics, name) in [
            (Kinematics::Total, "total"),
            (Kinematics::Incremental, "incremental"),
        ] {
            let mut simulation = free_block(kind, kinematics, wanted / pieces as f64);
            let elements = simulation.overview().elements;
            let [each, whole] = rayon::scope(|_| seconds_of_an_update(&mut simulation));
            let bytes = bytes_moved(kind, points, kinematics, &simulation);
            println!(
                "{:8} {name:12} {elements:9} {:8.2} {:11.2} {bytes:10.0} {:7.2} {:7.0} % {:16.2}",
                kind.name(),
                1e9 * each,
                1e-6 / each,
                1e-9 * bytes / each,
                100.0 * bytes / each / triad,
                1e-6 / whole,
            );
            rows.push(json!({
                "shape": kind.name(),
                "kinematics": name,
                "elements": elements,
                "updates_per_second": 1.0 / each,
                "updates_per_second_of_steps": 1.0 / whole,
                "bytes_moved": bytes,
                "share_of_triad": bytes / each / triad,
            }));
        }
    }
    let result = json!({ "threads": threads, "triad_bytes_per_second": triad, "kernels": rows });
    keep("kernels", &result)
}

/// Bytes that an update must move: gradients and volumes, numbers of nodes, records there and
/// back, and of each node its displacement, and its force there and back.
fn bytes_moved(
    kind: ElementKind,
    points: usize,
    kinematics: Kinematics,
    simulation: &Simulation,
) -> f64 {
    let (nodes, dimension) = (kind.node_count(), kind.dimension());
    let rest = 8 * points * ((nodes - 1) * dimension + 1) + 2 * nodes;
    let record = match kinematics {
        Kinematics::Total => 0,
        Kinematics::Incremental => {
            8 * ((nodes - 1) * dimension + points * dimension * (dimension + 1) / 2 + 1)
        }
    };
    let overview = simulation.overview();
    let of_nodes = 8 * 3 * dimension * overview.nodes;
    (rest + 2 * record) as f64 + of_nodes as f64 / overview.elements as f64
}

/// Bytes a second of a = b + s c, on all threads.
fn triad() -> f64 {
    let [mut a, b, c] = [0.0, 1.0, 2.0].map(|x| vec![x; TRIAD]);
    let share = TRIAD.div_ceil(rayon::current_num_threads());
    let mut best = f64::INFINITY;
    for _ in 0..TRIALS {
        let began = Instant::now();
        let parts = a.par_chunks_mut(share).zip(b.par_chunks(share));
        parts
            .zip(c.par_chunks(share))
            .for_each(|((a, b), c): ((&mut [f64], &[f64]), &[f64])| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + 3.0 * c;
                }
            });
        black_box(&mut a);
        best = best.min(began.elapsed().as_secs_f64());
    }
    (3 * 8 * TRIAD) as f64 / best
}
