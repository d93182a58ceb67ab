//! A block falls on a floor: from a scene to table rows, in memory.
//!
//!     cargo run --release -p cdem --example dropped_block

#![allow(clippy::print_stdout)] // the table is the result

use cdem::mesh::assemble;
use cdem::{AnyMesh, Simulation};
use serde_json::json;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The keys of a scene file, as JSON. Lengths in m, angles in degrees.
    let scene = cdem::scene::from_value(json!({
        "version": 1,
        "title": "A block falls on a floor",
        "dimension": 2,
        "gravity": [0.0, -9.81],
        "time": { "end": 0.2 },
        "material": [{
            "name": "rubber", "young_modulus": "10 MPa", "poisson_ratio": 0.3, "density": 1200.0
        }],
        "block": [
            {
                "name": "floor", "material": "rubber", "fixed": true, "element": "quad4",
                "shape": { "box": { "min": [-1.0, -0.2], "max": [1.0, 0.0], "divisions": [4, 1] } }
            },
            {
                "name": "stone", "material": "rubber", "element": "quad4",
                "shape": { "box": { "min": [-0.2, 0.05], "max": [0.2, 0.45], "divisions": [4, 4] } }
            }
        ],
        "contact": { "friction_angle": 20.0 }
    }))
    .map_err(|problems| problems[0].message.clone())?;
    // A scene of shapes reads no mesh file.
    let mesh = assemble::<2>(&scene, &mut |path| {
        panic!("no file is named: {}", path.display())
    })?;
    let mut simulation = Simulation::new(&scene, AnyMesh::Plane(mesh))?;
    println!("  time/s   height/m   speed/(m/s)   contacts   residual/J");
    while !simulation.finished() {
        for _ in 0..simulation.step_count().div_ceil(10) {
            if !simulation.finished() {
                simulation.step()?;
            }
        }
        let stone = &simulation.blocks()[1];
        let energies = simulation.history();
        println!(
            "{:8.4} {:10.4} {:13.4} {:10} {:12.1e}",
            simulation.time(),
            stone.position[1],
            stone.velocity[1],
            energies.contacts,
            energies.energy_residual
        );
    }
    Ok(())
}
