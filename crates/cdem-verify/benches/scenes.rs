//! The example scenes: element updates and block-steps per second, and the time of each stage.
//!
//! The columns before those of the stages are: the time of a step; the time that its element
//! updates would take in large blocks of the same element kinds without contact; the ratio of the
//! two; and the same ratio for the element forces alone.
//!
//! `cargo bench -p cdem-verify --bench scenes` runs each example for ten seconds or to its end. A
//! second run times the stages, which adds up to a quarter to the shortest steps. A third run
//! records the kinds of the updated elements. `-- 60` sets sixty seconds; `-- wall-2d crowd-3d`
//! runs these scenes only. No results are written except `target/bench/scenes.json`. It runs on
//! `RAYON_NUM_THREADS` threads.

#![allow(clippy::print_stdout, reason = "a benchmark tells what it finds")]

use cdem::mesh::ElementKind;
use cdem::output::FieldValues;
use cdem::scene::Kinematics;
use cdem::{Simulation, Stage};
use cdem_verify::example;
use cdem_verify::timing::{Asked, Timed, free_block, keep, seconds_of_an_update};
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

/// Number of cells of a large block.
const CELLS: f64 = 5e4;

fn main() -> std::io::Result<()> {
    let asked = Asked::of_command(&EXAMPLES)?;
    let seconds = asked.numbers.last().copied().unwrap_or(10.0);
    println!(
        "{} threads; shares of a step in per cent",
        rayon::current_num_threads()
    );
    print!(
        "{:14} {:>6} {:>8} {:>7} {:>6}",
        "scene", "blocks", "elements", "steps", "run"
    );
    print!(
        " {:>11} {:>13} {:>9} {:>9} {:>8} {:>8}",
        "updates/s", "block-steps/s", "us a step", "bulk's", "of bulk", "forces'"
    );
    for stage in Stage::ALL {
        print!(" {:>8}", short(stage));
    }
    println!();
    let mut bulk = Bulk::default();
    let mut rows = Vec::new();
    for name in EXAMPLES {
        if !asked.wants(name) {
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
        let of_kinds = updates_of_kinds(&mut case.start(), timed.steps);
        let [forces, whole] = bulk.seconds_of_a_mean_update(&of_kinds, kinematics);
        let of_bulk = timed.update_rate() * whole;
        let own_forces = staged.of_stage(Stage::Forces) / staged.updates as f64;
        let forces_of_bulk = forces / own_forces;
        let of_step = timed.seconds / timed.steps as f64;
        print!(
            " {:11.2e} {:13.2e} {:9.2} {:9.2} {:6.0} % {:6.0} %",
            timed.update_rate(),
            timed.block_rate(blocks),
            1e6 * of_step,
            1e6 * of_bulk * of_step,
            100.0 * of_bulk,
            100.0 * forces_of_bulk
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
            "forces_of_bulk": forces_of_bulk,
            "block_steps_per_second": timed.block_rate(blocks),
            "share_of_stages": staged.shares(),
        }));
    }
    keep(
        "scenes",
        &json!({ "threads": rayon::current_num_threads(), "scenes": rows }),
    )
}

/// Number of samples of the element kinds during a run.
const LOOKS: u64 = 100;

/// Counts the updates of each element kind in the moving blocks during `steps` steps, from samples
/// of some of the steps. Refinement zones come and go, and their elements may differ from those of
/// the block around them.
fn updates_of_kinds(run: &mut Simulation, steps: u64) -> Vec<(ElementKind, f64)> {
    let blocks = run.overview().blocks;
    let fixed: Vec<bool> = blocks.iter().map(|block| block.fixed).collect();
    let mut of_kinds: Vec<(ElementKind, f64)> = Vec::new();
    for look in 1..=LOOKS {
        let then = look * steps / LOOKS;
        let more = then.saturating_sub(run.step_index());
        rayon::scope(|_| Timed::of(run, |made, _| made >= more));
        let frame = run.frame();
        let [levels, blocks] = ["level", "block"].map(|name| {
            let field = frame.cell_fields.iter().find(|field| field.name == name);
            match field.map(|field| &field.values) {
                Some(FieldValues::Whole(numbers)) => numbers,
                _ => panic!("a frame has the {name} of each element"),
            }
        });
        let elements = frame.kinds.iter().zip(levels).zip(blocks);
        for ((&kind, &level), _) in elements.filter(|(_, block)| !fixed[**block as usize]) {
            let updates = f64::from(level).exp2();
            match of_kinds.iter_mut().find(|(of, _)| *of == kind) {
                Some((_, all)) => *all += updates,
                None => of_kinds.push((kind, updates)),
            }
        }
    }
    of_kinds
}

/// Time of element updates in large blocks without contact, by element kind and kinematics.
#[derive(Default)]
struct Bulk(Vec<((ElementKind, Kinematics), [f64; 2])>);

impl Bulk {
    /// Returns the mean time of the forces, and of a whole update, over these kinds weighted by
    /// their updates, s.
    fn seconds_of_a_mean_update(
        &mut self,
        of_kinds: &[(ElementKind, f64)],
        kinematics: Kinematics,
    ) -> [f64; 2] {
        let (mut seconds, mut all) = ([0.0; 2], 0.0);
        for &(kind, updates) in of_kinds {
            all += updates;
            let each = self.seconds(kind, kinematics);
            seconds = std::array::from_fn(|i| seconds[i] + updates * each[i]);
        }
        seconds.map(|seconds| seconds / all)
    }

    /// Returns the time of the forces, and of a whole update, for one kind, s.
    fn seconds(&mut self, kind: ElementKind, kinematics: Kinematics) -> [f64; 2] {
        let key = (kind, kinematics);
        if let Some((_, known)) = self.0.iter().find(|(of, _)| *of == key) {
            return *known;
        }
        let mut block = free_block(kind, kinematics, CELLS);
        let seconds = rayon::scope(|_| seconds_of_an_update(&mut block));
        self.0.push((key, seconds));
        seconds
    }
}

/// Returns the first word of a stage's name, which is unique.
fn short(stage: Stage) -> &'static str {
    stage.name().split(' ').next().unwrap_or_default()
}
