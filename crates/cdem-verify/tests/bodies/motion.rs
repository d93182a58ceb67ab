//! Prescribed motion.

use cdem::scene::{Boundary, BoundaryTarget, Field, Motion, Schedule};
use cdem_verify::{load, run};

use crate::shared::{displacements, length};

#[test]
fn a_driven_side_ends_where_its_table_says() {
    let case = load("driven-block");
    let mut simulation = case.start();
    run(&mut simulation, |_| {});
    let row = simulation.history();
    let probe = simulation.probe_rows().remove(0);
    println!(
        "side at {:?}, residual {:.1e} of {:.1e} J",
        probe.displacement, row.energy_residual, row.external_work
    );
    // The integral of the table is exact and sums are compensated: round-off of 0.04 m, once per
    // ten steps.
    assert!((probe.displacement[0] - 0.04).abs() < 1e-15);
    assert_eq!(probe.displacement[1], 0.0);
    assert!(row.energy_residual.abs() < 1e-3 * row.external_work.abs().max(row.kinetic_energy));
}

#[test]
fn a_turned_block_stays_rigid_on_exact_circles() {
    let mut case = load("driven-block");
    case.scene.output.fields = vec![Field::Displacement];
    let point = [-1.0, 0.5, 0.0];
    case.scene.boundary = vec![Boundary {
        target: BoundaryTarget::Block("block".to_owned()),
        motion: Motion::Turn {
            axis: [0.0, 0.0, 1.0],
            point,
            angular_velocity: Schedule::Table(vec![(0.0, 0.0), (0.05, 400.0)]),
        },
        start: 0.0,
        end: None,
    }];
    let mut simulation = case.start();
    run(&mut simulation, |_| {});
    // ½ · 400 · 0.05 rad.
    let (sine, cosine) = 10.0_f64.sin_cos();
    let mut worst = [0.0_f64; 2];
    for (at, u) in displacements(&mut simulation) {
        let arm = [at[0] - point[0], at[1] - point[1], 0.0];
        let now: [f64; 3] = std::array::from_fn(|c| arm[c] + u[c]);
        let turned = [
            cosine * arm[0] - sine * arm[1],
            sine * arm[0] + cosine * arm[1],
            0.0,
        ];
        worst[0] = worst[0].max((length(&now) / length(&arm) - 1.0).abs());
        let apart: [f64; 3] = std::array::from_fn(|c| now[c] - turned[c]);
        worst[1] = worst[1].max(length(&apart) / length(&arm));
    }
    let row = simulation.history();
    println!(
        "turned by 10 rad: radius to {:.1e}, place to {:.1e}, strain energy {:.1e} of {:.1e} J, residual {:.1e} J",
        worst[0], worst[1], row.strain_energy, row.kinetic_energy, row.energy_residual
    );
    // Round-off of the number of steps in the run.
    let limit = f64::EPSILON * simulation.step_count() as f64;
    assert!(worst[0] < limit && worst[1] < 10.0 * limit);
    assert!(row.strain_energy < 1e-15 * row.kinetic_energy);
    // All work is the kinetic energy of a rigid body, except (ωΔt)²/12 of it, because steps are
    // chords of the arcs.
    assert!(row.energy_residual.abs() < 1e-3 * row.kinetic_energy);
}
