//! Saves a run half-way, resumes it, and checks that both runs end with the same bits.
//!
//!     cargo run --release -p cdem --example checkpoint

#![allow(clippy::print_stdout)] // the table is the result

use cdem::mesh::assemble;
use cdem::scene::Scene;
use cdem::{AnyMesh, Simulation};
use serde_json::json;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = cdem::scene::from_value(json!({
        "version": 1,
        "dimension": 2,
        "time": { "end": 0.02 },
        "material": [{
            "name": "rock", "young_modulus": "1 GPa", "poisson_ratio": 0.25, "density": 2500.0
        }],
        "block": [
            {
                "name": "a", "material": "rock", "velocity": [4.0, 0.0],
                "shape": { "polygon": [[0.0, 0.0], [1.0, 0.5], [0.0, 1.0]], "size": 1.0 }
            },
            {
                "name": "b", "material": "rock",
                "shape": { "polygon": [[1.02, 0.0], [2.0, 0.0], [2.0, 1.0], [1.02, 1.0]], "size": 1.0 }
            }
        ]
    }))
    .map_err(|problems| problems[0].message.clone())?;
    let mut whole = start(&scene)?;
    let half = whole.step_count() / 2;
    while whole.step_index() < half {
        whole.step()?;
    }
    // Plain bytes, for a file or another machine. They contain neither the scene nor the mesh.
    let checkpoint = whole.checkpoint();
    let mut resumed = start(&scene)?.resumed(&checkpoint)?;
    for run in [&mut whole, &mut resumed] {
        while !run.finished() {
            run.step()?;
        }
    }
    assert_eq!(whole.history(), resumed.history());
    assert_eq!(whole.positions(), resumed.positions());
    println!(
        "{} bytes after step {half}; both runs end with {:?} contacts and {:.6} J of kinetic energy",
        checkpoint.len(),
        whole.contacts_begun(),
        whole.history().kinetic_energy
    );
    Ok(())
}

/// Creates the run of the scene at t = 0.
fn start(scene: &Scene) -> Result<Simulation, Box<dyn std::error::Error>> {
    let mesh = assemble::<2>(scene, &mut |path| {
        panic!("no file is named: {}", path.display())
    })?;
    Ok(Simulation::new(scene, AnyMesh::Plane(mesh))?)
}
