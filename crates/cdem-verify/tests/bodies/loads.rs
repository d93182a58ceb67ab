//! Loads, gravity and damping.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::{LoadKind, Schedule};
use cdem_verify::{Case, load, run};

use crate::shared::{LameMode, length};

#[test]
fn traction_moves_the_centre_by_newton() {
    let mut simulation = load("loaded-block").start();
    run(&mut simulation, |_| {});
    let row = simulation.history();
    let block = simulation.block_rows().remove(0);
    let exact = 1e5 * 0.5 / 1350.0 * simulation.time();
    let path = 0.5 * exact * simulation.time();
    println!(
        "traction: velocity {:.3e} off, path {:.3e} off, residual {:.1e} of {:.1e} J",
        block.velocity[0] / exact - 1.0,
        (block.position[0] - 0.5) / path - 1.0,
        row.energy_residual,
        row.external_work
    );
    assert!((block.velocity[0] / exact - 1.0).abs() < 1e-12);
    assert!(((block.position[0] - 0.5) / path - 1.0).abs() < 1e-12);
    // The sudden load sends out a rough wave, whose energy oscillates.
    assert!(row.energy_residual.abs() < 1e-2 * row.external_work);
}

fn pressure_does_nothing_net(mut simulation: Simulation, force: f64) {
    let start = simulation.history();
    run(&mut simulation, |_| {});
    let row = simulation.history();
    let change = |now: [f64; 3], then: [f64; 3]| length(&std::array::from_fn(|c| now[c] - then[c]));
    let pushed = force * simulation.time();
    let momentum = change(row.momentum, start.momentum) / pushed;
    let turning = change(row.angular_momentum, start.angular_momentum) / pushed;
    println!(
        "pressure all round: net impulse {momentum:.1e}, net moment {turning:.1e} m of that of one side; residual {:.1e} of {:.1e} J",
        row.energy_residual, row.external_work
    );
    // Round-off only, because areas and normals are those of the present shape.
    assert!(momentum < 1e-12 && turning < 1e-12);
}

#[test]
fn pressure_on_a_closed_surface_has_no_resultant() {
    let mut case = load("loaded-block");
    let side = case.scene.load[0].clone();
    case.scene.load = ["xmin", "xmax", "ymin", "ymax"]
        .map(|name| {
            let mut side = side.clone();
            side.group = format!("block.{name}");
            side.kind = LoadKind::Pressure(Schedule::Constant(1e6));
            side
        })
        .to_vec();
    case.scene.block[0].angular_velocity = vec![30.0];
    pressure_does_nothing_net(case.start(), 0.5e6);
    for shape in [ElementKind::Hex8, ElementKind::Wedge6, ElementKind::Tet4] {
        let mut case = load("loaded-block-3d");
        case.divide("block", &[3, 2, 2], shape);
        pressure_does_nothing_net(case.start(), 0.24e6);
    }
}

#[test]
fn bodies_fall_freely() {
    let mut case = load("loaded-block");
    case.scene.load.clear();
    case.scene.gravity = Schedule::Constant(vec![1.0, -9.81]);
    case.scene.block[0].velocity = vec![0.0, 2.0];
    let mut simulation = case.start();
    let start = simulation.history();
    run(&mut simulation, |_| {});
    let (row, time) = (simulation.history(), simulation.time());
    let block = simulation.block_rows().remove(0);
    let velocity = block.velocity[1] - (2.0 - 9.81 * time);
    let place = block.position[1] - (0.25 + 2.0 * time - 0.5 * 9.81 * time * time);
    println!(
        "free fall: velocity off by {velocity:.1e} m/s, place by {place:.1e} m, residual {:.1e} of {:.1e} J",
        row.energy_residual, start.kinetic_energy
    );
    // Leapfrog is exact for a constant force; round-off remains.
    assert!(velocity.abs() < 1e-13 && place.abs() < 1e-14);
    assert!(row.energy_residual.abs() < 1e-11 * start.kinetic_energy);
}

#[test]
fn mass_proportional_damping_slows_by_its_exponential() {
    for alpha in [10.0, 100.0] {
        let mut case = load("loaded-block");
        case.scene.load.clear();
        case.scene.material[0].damping.mass = alpha;
        case.scene.block[0].velocity = vec![3.0, -1.0];
        let mut simulation = case.start();
        run(&mut simulation, |_| {});
        let (row, time) = (simulation.history(), simulation.time());
        let block = simulation.block_rows().remove(0);
        let error = block.velocity[0] / (3.0 * (-alpha * time).exp()) - 1.0;
        let step = simulation.overview().step;
        println!(
            "alpha {alpha}: velocity off by {error:.1e}, residual {:.1e} of {:.1e} J lost",
            row.energy_residual, row.damping_loss
        );
        // Trapezoidal rule: (αΔt)²/12 of αt, and twice as much for the half kicks at both ends.
        assert!(error.abs() < (alpha * step).powi(2) * (alpha * time / 12.0 + 0.5));
        assert!(row.energy_residual.abs() < 1e-3 * row.damping_loss);
    }
}

/// Returns the decay rate of Lamé's mode over the exact βω²/2, less 1.
fn decay_error(case: &mut Case, divisions: usize, safety: f64) -> f64 {
    case.divide("block", &[divisions; 2], ElementKind::Quad4);
    case.scene.time.safety = safety;
    let mode = LameMode::new(case);
    let beta = case.scene.material[0].damping.stiffness;
    // Whole periods, so that energies are compared at equal phase.
    case.scene.time.end = 3.0 * std::f64::consts::TAU / mode.omega;
    let mut simulation = mode.start(case);
    let start = simulation.history();
    run(&mut simulation, |_| {});
    let row = simulation.history();
    let energy = row.kinetic_energy + row.strain_energy;
    let exponent = -(energy / start.kinetic_energy).ln();
    let exact = beta * mode.omega.powi(2) * simulation.time();
    println!(
        "beta {beta:e}, {divisions} cells, safety {safety}: decay off by {:.2e}, residual {:.1e} of the loss",
        exponent / exact - 1.0,
        row.energy_residual / row.damping_loss
    );
    exponent / exact - 1.0
}

#[test]
fn stiffness_proportional_damping_slows_a_mode_by_its_exponential() {
    let mut case = load("lame-mode-2d");
    case.scene.material[0].damping.stiffness = 2e-6;
    let errors: Vec<f64> = [8, 16, 32]
        .iter()
        .map(|&divisions| decay_error(&mut case, divisions, 0.4))
        .collect();
    // At least first order in h and Δt together, because the viscous stress is that of the velocity
    // half a step earlier.
    assert!(errors[2].abs() < 0.6 * errors[1].abs() && errors[2].abs() < 1e-2);
}
