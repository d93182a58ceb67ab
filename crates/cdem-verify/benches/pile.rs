//! A pile of one-element blocks, settled: `cargo bench --bench pile -- 10 10 10`.

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a benchmark"
)]

use std::time::Instant;

use cdem::mesh::ElementKind;
use cdem::scene::Geometry;
use cdem_verify::{Case, SEED, load, rocks_of};

fn resize(case: &mut Case, across: [usize; 3]) {
    let [x, y, z] = across.map(|count| count as f64);
    let sides = [
        ("floor", [-1.0, -1.0, -1.0], [x + 1.0, y + 1.0, 0.0]),
        ("west", [-1.0, -1.0, 0.0], [0.0, y + 1.0, z + 3.0]),
        ("east", [x, -1.0, 0.0], [x + 1.0, y + 1.0, z + 3.0]),
        ("south", [0.0, -1.0, 0.0], [x, 0.0, z + 3.0]),
        ("north", [0.0, y, 0.0], [x, y + 1.0, z + 3.0]),
    ];
    for (name, low, high) in sides {
        if let Geometry::Box { min, max, .. } = &mut case.block(name).geometry {
            (*min, *max) = (low.to_vec(), high.to_vec());
        }
    }
}

fn main() {
    let numbers: Vec<f64> = std::env::args()
        .filter_map(|word| word.parse().ok())
        .collect();
    let count = |k: usize| numbers.get(k).map_or(6, |&x| x as usize);
    let across = [0, 1, 2].map(count);
    let settled = numbers.get(3).copied().unwrap_or(2.5);
    let measured = numbers.get(4).copied().unwrap_or(0.1);
    let mut case = load("rocks-in-a-box");
    case.scene.time.end = settled + measured;
    for material in &mut case.scene.material {
        material.damping.mass = 1.0;
    }
    resize(&mut case, across);
    let mut simulation = case.start_from(|_| rocks_of(&[ElementKind::Hex8], SEED, across, false));
    let blocks = across.iter().product::<usize>();
    println!("step {:e}", simulation.overview().step);
    let mut begun = Instant::now();
    let mut tenth = 0.1;
    rayon::scope(|_| {
        while simulation.time() < settled {
            simulation.step().expect("a step");
            if simulation.time() >= tenth {
                tenth += 0.5;
                eprintln!(
                    "{:.2} s  {:.1} s  {} contacts",
                    simulation.time(),
                    begun.elapsed().as_secs_f64(),
                    simulation.live_contacts().len()
                );
            }
        }
        simulation.time_stages();
        begun = Instant::now();
        let first = simulation.step_index();
        while !simulation.finished() {
            simulation.step().expect("a step");
        }
        let steps = simulation.step_index() - first;
        let spent = begun.elapsed().as_secs_f64();
        println!(
            "{blocks} blocks, {} contacts, {steps} steps in {spent:.2} s: {:.3e} block-steps a second",
            simulation.live_contacts().len(),
            (steps as f64) * blocks as f64 / spent
        );
        for (stage, time) in simulation.stage_times() {
            println!(
                "{:28} {:5.1} %  {:.2} us a block-step",
                stage.name(),
                100.0 * time.as_secs_f64() / spent,
                1e6 * time.as_secs_f64() / (steps as f64 * blocks as f64)
            );
        }
    });
    let rows = simulation.block_rows();
    let mut speeds: Vec<f64> = rows[..blocks]
        .iter()
        .map(|row| row.velocity.iter().map(|v| v * v).sum::<f64>().sqrt())
        .collect();
    speeds.sort_by(f64::total_cmp);
    println!(
        "median {:e} 90 {:e} 99 {:e} max {:e}",
        speeds[blocks / 2],
        speeds[blocks * 9 / 10],
        speeds[blocks * 99 / 100],
        speeds[blocks - 1]
    );
}
