//! Element kernels in free flight, for all shapes, compared with the memory bandwidth and the peak
//! arithmetic of the machine in the same run.
//!
//! `cargo bench -p cdem-verify --bench kernels` uses about 200 000 elements of each shape; `-- 1e6`
//! a million; `-- tet4 tri3` these shapes only. It runs on `RAYON_NUM_THREADS` threads and writes
//! `target/bench/kernels.json`.

#![allow(clippy::print_stdout, reason = "a benchmark tells what the clock says")]

use cdem::UpdateCost;
use cdem::mesh::ElementKind;
use cdem::scene::Kinematics;
use cdem_verify::machine::{peak_arithmetic, triad};
use cdem_verify::timing::{Asked, free_block, keep, seconds_of_an_update};
use serde_json::json;

/// Shapes, and the number of elements of each in a cell of a box.
const SHAPES: [(ElementKind, usize); 5] = [
    (ElementKind::Tri3, 2),
    (ElementKind::Quad4, 1),
    (ElementKind::Tet4, 6),
    (ElementKind::Wedge6, 2),
    (ElementKind::Hex8, 1),
];

fn main() -> std::io::Result<()> {
    let asked = Asked::of_command(&SHAPES.map(|(kind, ..)| kind.name()))?;
    let wanted = asked.numbers.last().copied().unwrap_or(2e5);
    let (triad, peak) = (triad(), peak_arithmetic());
    let threads = rayon::current_num_threads();
    println!(
        "{threads} threads; triad {:.1} GB/s; peak {:.1} billion additions and multiplications/s",
        triad / 1e9,
        peak / 1e9
    );
    println!(
        "{:8} {:12} {:>9} {:>7} {:>10} {:>6} {:>6} {:>9} {:>10} {:>8} {:>17}",
        "shape",
        "kinematics",
        "elements",
        "ns",
        "million/s",
        "bytes",
        "GB/s",
        "of triad",
        "operations",
        "of peak",
        "steps, million/s"
    );
    let mut rows = Vec::new();
    for (kind, pieces) in SHAPES {
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
            let UpdateCost { bytes, operations } = simulation.update_cost();
            println!(
                "{:8} {name:12} {elements:9} {:7.2} {:10.2} {bytes:6.0} {:6.2} {:7.0} % \
                 {operations:10.0} {:6.0} % {:17.2}",
                kind.name(),
                1e9 * each,
                1e-6 / each,
                1e-9 * bytes / each,
                100.0 * bytes / each / triad,
                100.0 * operations / each / peak,
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
                "operations": operations,
                "share_of_peak": operations / each / peak,
            }));
        }
    }
    let result = json!({
        "threads": threads,
        "triad_bytes_per_second": triad,
        "peak_operations_per_second": peak,
        "kernels": rows,
    });
    keep("kernels", &result)
}
