//! Two blocks collide. Prints the contact points, one row each, as in `contacts.csv`.
//!
//!     cargo run --release -p cdem --example contact_points

#![allow(clippy::print_stdout)] // the table is the result

use cdem::mesh::assemble;
use cdem::{AnyMesh, Simulation};
use serde_json::json;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let block = |name: &str, left: f64, bottom: f64, speed: f64| {
        json!({
            "name": name, "material": "rock", "element": "hex8", "velocity": [speed, 0.0, 0.0],
            "shape": { "box": {
                "min": [left, bottom, 0.0], "max": [left + 1.0, bottom + 1.0, 1.0],
                "divisions": [2, 2, 2]
            } }
        })
    };
    let scene = cdem::scene::from_value(json!({
        "version": 1,
        "dimension": 3,
        "time": { "end": 2e-3 },
        "material": [{
            "name": "rock", "young_modulus": "40 GPa", "poisson_ratio": 0.25, "density": 2700.0
        }],
        "block": [block("left", 0.0, 0.0, 2.0), block("right", 1.001, 0.3, 0.0)],
        "contact": { "model": "unified-node", "friction_angle": 30.0 }
    }))
    .map_err(|problems| problems[0].message.clone())?;
    let mesh = assemble::<3>(&scene, &mut |path| {
        panic!("no file is named: {}", path.display())
    })?;
    let mut simulation = Simulation::new(&scene, AnyMesh::Solid(mesh))?;
    let mut rows = Vec::new();
    while !simulation.finished() {
        simulation.step()?;
        rows.extend(simulation.ended_contacts());
    }
    rows.extend(simulation.live_contacts());
    println!("type           main    target   from/ms   impulse/(N·s)   peak force/kN");
    for row in &rows {
        println!(
            "{:14} {:7} {:7} {:9.4} {:15.1} {:15.1}",
            row.kind.name(),
            row.main,
            row.target,
            1e3 * row.time_on,
            row.normal_impulse,
            1e-3 * row.peak_normal_force
        );
    }
    let total: f64 = rows.iter().map(|row| row.normal_impulse).sum();
    let right = &simulation.blocks()[1];
    println!(
        "impulse {total:.1} N·s, momentum of the right block {:.1} N·s",
        right.mass * right.velocity[0]
    );
    Ok(())
}
