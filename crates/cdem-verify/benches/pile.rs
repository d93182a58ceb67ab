//! A settled pile of one-element hexahedra: block-steps per second, and the time of each stage.
//!
//! `cargo bench -p cdem-verify --bench pile -- 10 10 10` takes 10 × 10 × 10 blocks (6 × 6 × 6
//! without numbers), lets them fall for 8 s and measures the next 0.1 s; `-- 10 10 10 5.0 0.2`
//! measures 0.2 s after 5 s. It runs on `RAYON_NUM_THREADS` threads and writes
//! `target/bench/pile.json`. The settled pile is saved beside that file, with the numbers in its
//! name. The next run with the same numbers resumes from it, so that two versions are compared on
//! one pile. Remove `target/bench/*.settled` to settle again.

#![allow(clippy::print_stdout, reason = "a benchmark tells what it finds")]

use std::path::Path;

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem_verify::timing::{Asked, Timed, folder, keep, step};
use cdem_verify::{SEED, box_around, load, rocks_of};
use serde_json::json;

/// Mass-proportional damping, 1/s. Rolling blocks come to rest within seconds.
const DAMPING: f64 = 1.0;

fn main() -> std::io::Result<()> {
    let asked = Asked::of_command(&[])?;
    let number = |k: usize, default| asked.numbers.get(k).copied().unwrap_or(default);
    let across = [0, 1, 2].map(|k| number(k, 6.0).ceil() as usize);
    let (settled, measured) = (number(3, 8.0), number(4, 0.1));
    let [x, y, z] = across;
    let kept = folder()?.join(format!("pile-{x}-{y}-{z}-{settled}-{measured}.settled"));
    let fallen = rayon::scope(|_| settle(start(across, settled + measured), settled, &kept))?;
    let result = rayon::scope(|_| measure(fallen, across.iter().product()));
    keep("pile", &result)
}

/// Builds `across` blocks along each axis that fall for `end` seconds.
fn start(across: [usize; 3], end: f64) -> Simulation {
    let mut case = load("rocks-in-a-box");
    case.scene.time.end = end;
    for material in &mut case.scene.material {
        material.damping.mass = DAMPING;
    }
    box_around(&mut case, across);
    case.start_from(|_| rocks_of(&[ElementKind::Hex8], SEED, across, false))
}

/// Returns the pile after `settled` seconds: read from `kept`, or computed and saved there.
fn settle(mut simulation: Simulation, settled: f64, kept: &Path) -> std::io::Result<Simulation> {
    if let Ok(state) = std::fs::read(kept) {
        return simulation.resumed(&state).map_err(std::io::Error::other);
    }
    while simulation.time() < settled {
        step(&mut simulation);
    }
    std::fs::write(kept, simulation.checkpoint())?;
    Ok(simulation)
}

/// Runs to the end and reports the time.
fn measure(mut simulation: Simulation, blocks: usize) -> serde_json::Value {
    let timed = Timed::in_stages(&mut simulation, |_, _| false);
    let rate = timed.block_rate(blocks);
    let contacts = simulation.live_contacts().len();
    let fastest = simulation.block_rows()[..blocks]
        .iter()
        .map(|row| row.velocity.iter().map(|v| v * v).sum::<f64>().sqrt())
        .fold(0.0, f64::max);
    println!(
        "{blocks} blocks, {contacts} contacts, the fastest at {fastest:.1e} m/s, {} threads: \
         {rate:.3e} block-steps a second",
        rayon::current_num_threads(),
    );
    println!("{:26} {:>8} {:>16}", "stage", "share", "of a block-step");
    for (stage, time) in &timed.stages {
        let share = time / timed.seconds;
        println!(
            "{:26} {:6.1} % {:13.2} us",
            stage.name(),
            100.0 * share,
            1e6 * share / rate
        );
    }
    json!({
        "blocks": blocks,
        "contacts": contacts,
        "fastest_block": fastest,
        "threads": rayon::current_num_threads(),
        "block_steps_per_second": rate,
        "share_of_stages": timed.shares(),
    })
}
