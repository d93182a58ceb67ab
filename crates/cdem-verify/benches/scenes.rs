//! Whole scenes, the examples: updates and block-steps a second, and where the time goes.
//!
//! The last columns but those of the stages are what a step takes, what its updates of elements
//! would take in large blocks that touch nothing, of the kinds that a run ends with, and the share.
//!
//! `cargo bench -p cdem-verify --bench scenes` steps each example for ten seconds or to its end,
//! and once more with the clock of the stages, which takes up to a quarter of the shortest steps;
//! `-- 60` for sixty seconds, `-- wall-2d crowd-3d` these alone; without results, on
//! `RAYON_NUM_THREADS` threads. Writes `target/bench/scenes.json` too.

#![allow(clippy::print_stdout, reason = "a benchmark tells what it finds")]

use cdem::mesh::ElementKind;
use cdem::sample::FieldValues;
use cdem::scene::Kinematics;
use cdem::{Simulation, Stage};
use cdem_verify::example;
use cdem_verify::timing::{Timed, free_block, keep, seconds_of_an_update};
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

/// Cells of a large block.
const CELLS: f64 = 5e4;

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
    print!(
        " {:>11} {:>13} {:>9} {:>9} {:>8}",
        "updates/s", "block-steps/s", "us a step", "bulk's", "of bulk"
    );
    for stage in Stage::ALL {
        print!(" {:>8}", short(stage));
    }
    println!();
    let mut bulk = Bulk::default();
    let mut rows = Vec::new();
    for name in EXAMPLES {
        if any_named && !is_named(name) {
            continue;
        }
        let case = example(name);
        let mut simulation = case.start();
        let overview = simulation.overview();
        let (blocks, elements) = (overview.blocks.len(), overview.elements);
        let timed = rayon::scope(|_| Timed::of(&mut simulation, |_, spent| spent > seconds));
        let are_as_many = |steps, _| steps >= timed.steps;
        let staged = rayon::scope(|_| Timed::in_stages(&mut case.start(), are_as_many));
        let run = timed.steps as f64 / overview.step_count as f64;
        print!(
            "{name:14} {blocks:6} {elements:8} {:7} {:4.0} %",
            timed.steps,
            100.0 * run
        );
        let kinematics = case.scene.block[0].kinematics;
        let of_update = bulk.seconds_of_a_mean_update(&mut simulation, kinematics);
        let of_bulk = timed.update_rate() * of_update;
        let of_step = timed.seconds / timed.steps as f64;
        print!(
            " {:11.2e} {:13.2e} {:9.2} {:9.2} {:6.0} %",
            timed.update_rate(),
            timed.block_rate(blocks),
            1e6 * of_step,
            1e6 * of_bulk * of_step,
            100.0 * of_bulk
        );
        for (_, time) in &staged.stages {
            print!(" {:8.1}", 100.0 * time / staged.seconds);
        }
        println!();
        rows.push(json!({
            "scene": name,
            "blocks": blocks,
            "elements": elements,
            "steps": timed.steps,
            "share_of_run": run,
            "updates_per_second": timed.update_rate(),
            "seconds_of_a_step": of_step,
            "of_bulk": of_bulk,
            "block_steps_per_second": timed.block_rate(blocks),
            "share_of_stages": staged.shares(),
        }));
    }
    keep(
        "scenes",
        &json!({ "threads": rayon::current_num_threads(), "scenes": rows }),
    )
}

/// What updates of elements take in large blocks that touch nothing.
#[derive(Default)]
struct Bulk(Vec<((ElementKind, Kinematics), f64)>);

impl Bulk {
    /// Of the kinds that blocks which move have now, each as often as it is updated, s.
    fn seconds_of_a_mean_update(&mut self, run: &mut Simulation, kinematics: Kinematics) -> f64 {
        let frame = run.frame();
        let fixed: Vec<bool> = run
            .overview()
            .blocks
            .iter()
            .map(|block| block.fixed)
            .collect();
        let [levels, blocks] = ["level", "block"].map(|name| {
            let field = frame.cell_fields.iter().find(|field| field.name == name);
            match field.map(|field| &field.values) {
                Some(FieldValues::Whole(numbers)) => numbers,
                _ => panic!("a frame has the {name} of each element"),
            }
        });
        let (mut seconds, mut updates) = (0.0, 0.0);
        let elements = frame.kinds.iter().zip(levels).zip(blocks);
        for ((&kind, &level), _) in elements.filter(|(_, block)| !fixed[**block as usize]) {
            let of_step = f64::from(level).exp2();
            updates += of_step;
            seconds += of_step * self.seconds(kind, kinematics);
        }
        seconds / updates
    }

    /// Of one kind, forces and all, s.
    fn seconds(&mut self, kind: ElementKind, kinematics: Kinematics) -> f64 {
        let key = (kind, kinematics);
        if let Some((_, known)) = self.0.iter().find(|(of, _)| *of == key) {
            return *known;
        }
        let mut block = free_block(kind, kinematics, CELLS);
        let [_, whole] = rayon::scope(|_| seconds_of_an_update(&mut block));
        self.0.push((key, whole));
        whole
    }
}

/// The first word of a stage's name that tells it from others.
fn short(stage: Stage) -> &'static str {
    stage.name().split(' ').next().unwrap_or_default()
}
