//! Whole scenes, the examples: updates and block-steps a second, and where the time goes.
//!
//! `cargo bench -p cdem-verify --bench scenes` steps each example for ten seconds or to its end,
//! `-- 60` for sixty, `-- wall-2d crowd-3d` these alone; without results, on
//! `RAYON_NUM_THREADS` threads. Writes `target/bench/scenes.json` too.

#![allow(clippy::print_stdout, reason = "a benchmark tells what it finds")]

use cdem::Stage;
use cdem_verify::example;
use cdem_verify::timing::{Timed, keep};
use serde_json::json;

const EXAMPLES: [&str; 8] = [
    "bars-2d",
    "two-prisms-2d",
    "two-prisms-3d",
    "slope-2d",
    "wall-2d",
    "crowd-2d",
    "crowd-3d",
    "rockfall-3d",
];

fn main() -> std::io::Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let mut seconds = words.iter().filter_map(|word| word.parse().ok());
    let seconds: f64 = seconds.next_back().unwrap_or(10.0);
    let is_named = |name: &str| words.iter().any(|word| word == name);
    let any_named = EXAMPLES.iter().any(|name| is_named(name));
    println!(
        "{} threads; shares of a step in per cent",
        rayon::current_num_threads()
    );
    print!(
        "{:14} {:>6} {:>8} {:>7} {:>6}",
        "scene", "blocks", "elements", "steps", "run"
    );
    print!(" {:>11} {:>13}", "updates/s", "block-steps/s");
    for stage in Stage::ALL {
        print!(" {:>8}", short(stage));
    }
    println!();
    let mut rows = Vec::new();
    for name in EXAMPLES {
        if any_named && !is_named(name) {
            continue;
        }
        let mut simulation = example(name).start();
        let overview = simulation.overview();
        let (blocks, elements) = (overview.blocks.len(), overview.elements);
        let timed = rayon::scope(|_| Timed::of(&mut simulation, |_, spent| spent > seconds));
        let run = timed.steps as f64 / overview.step_count as f64;
        print!(
            "{name:14} {blocks:6} {elements:8} {:7} {:4.0} %",
            timed.steps,
            100.0 * run
        );
        print!(
            " {:11.2e} {:13.2e}",
            timed.update_rate(),
            timed.block_rate(blocks)
        );
        for (_, time) in &timed.stages {
            print!(" {:8.1}", 100.0 * time / timed.seconds);
        }
        println!();
        rows.push(json!({
            "scene": name,
            "blocks": blocks,
            "elements": elements,
            "steps": timed.steps,
            "share_of_run": run,
            "updates_per_second": timed.update_rate(),
            "block_steps_per_second": timed.block_rate(blocks),
            "share_of_stages": timed.shares(),
        }));
    }
    keep(
        "scenes",
        &json!({ "threads": rayon::current_num_threads(), "scenes": rows }),
    )
}

/// The first word of a stage's name that tells it from others.
fn short(stage: Stage) -> &'static str {
    stage.name().split(' ').next().unwrap_or_default()
}
