//! Speed of waves, and what mesh and step make of it.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::{Boundary, BoundaryTarget, Motion, Schedule};
use cdem_verify::{Case, load, run};

use crate::shared::{from_file, p_wave_speed};

/// Time between the means of the pulse at the two probes.
fn travel_time(case: &Case) -> f64 {
    let mut simulation = case.start();
    let mut sums = [[0.0; 2]; 2];
    run(&mut simulation, |simulation| {
        for (row, sum) in simulation.probe_rows().iter().zip(&mut sums) {
            sum[0] += row.velocity[0];
            sum[1] += row.velocity[0] * row.time;
        }
    });
    let [near, far] = sums.map(|[sum, moment]| moment / sum);
    far - near
}

#[test]
fn a_pulse_runs_at_the_speed_of_sound() {
    for (poisson_ratio, what) in [(0.25, "plane strain"), (0.0, "bar")] {
        let mut case = load("wave-in-strip");
        case.scene.material[0].poisson_ratio = poisson_ratio;
        if poisson_ratio == 0.0 {
            case.scene.boundary.clear();
        }
        let exact = p_wave_speed(&case);
        let measured = 5.0 / travel_time(&case);
        println!(
            "{what}: pulse at {measured:.3} m/s, exact {exact:.3}, ratio − 1 {:.1e}",
            measured / exact - 1.0
        );
        // Mean times are those of the longest waves; what is left is the
        // tail of short waves behind the end of the run.
        assert!((measured / exact - 1.0).abs() < 1e-3);
    }
}

/// cos(ωΔt) of a vibration from the displacements of one node: central
/// differences of a single mode obey u₊ + u₋ = 2 cos(ωΔt) u.
fn phase(mut simulation: Simulation) -> f64 {
    let mut path = vec![0.0];
    run(&mut simulation, |simulation| {
        path.push(simulation.probe_rows()[0].displacement[0])
    });
    let (mut above, mut below) = (0.0, 0.0);
    for window in path.windows(3) {
        above += (window[0] + window[2]) * window[1];
        below += 2.0 * window[1] * window[1];
    }
    (above / below).acos()
}

/// Error of ω against sin(ωΔt/2) = C sin(kh/2), and c_num/c.
fn dispersion(mut case: Case, courant: f64, half_waves: usize, held_ends: bool) -> [f64; 2] {
    const CELLS: f64 = 40.0;
    let (speed, length) = (p_wave_speed(&case), 10.0);
    let size = length / CELLS;
    let step = courant * size / speed;
    case.scene.load.clear();
    case.scene.time.step = Some(step);
    case.scene.time.end = 400.0 * step;
    let probe = &mut case.scene.probe;
    probe.truncate(1);
    // Next to the end: no node of any of the waves.
    probe[0].point[0] = if held_ends { size } else { 0.0 };
    let wave_number = half_waves as f64 * std::f64::consts::PI / length;
    let mut simulation = case.start();
    assert_eq!(simulation.overview().levels.len(), 1, "one step for all");
    // Strains of 1e-9: round-off and nonlinearity far below what is measured.
    simulation.set_initial_velocities(&|at| {
        let phase = wave_number * at[0];
        let shape = if held_ends { phase.sin() } else { phase.cos() };
        [1e-9 * speed * shape, 0.0, 0.0]
    });
    let exact = 2.0 * (courant * (0.5 * wave_number * size).sin()).asin();
    let measured = phase(simulation);
    [
        measured / exact - 1.0,
        measured / (wave_number * speed * step),
    ]
}

#[test]
fn single_waves_disperse_as_central_differences_do() {
    let rod = || {
        let mut case = load("wave-in-strip");
        case.scene.material[0].poisson_ratio = 0.0;
        case.divide("strip", &[40, 1], ElementKind::Quad4);
        case
    };
    let strain = || {
        let mut case = load("wave-in-strip");
        case.divide("strip", &[40, 1], ElementKind::Quad4);
        case
    };
    let triangles = || {
        let mut case = load("wave-in-strip");
        from_file(&mut case, "triangles.msh");
        for group in ["left", "right"] {
            case.scene.boundary.push(Boundary {
                target: BoundaryTarget::Group(group.to_owned()),
                motion: Motion::Velocity([Some(Schedule::Constant(0.0)), None, None]),
                start: 0.0,
                end: None,
            });
        }
        case
    };
    let hexahedra = || {
        let mut case = load("wave-in-bar-3d");
        let mut probe = load("wave-in-strip").scene.probe.remove(0);
        probe.point = vec![0.0; 3];
        case.scene.probe.push(probe);
        case
    };
    let mut worst = 0.0_f64;
    // 20, 10 and 5 elements a wave.
    for half_waves in [4, 8, 16] {
        for courant in [0.5, 0.9] {
            let mut cases = vec![
                ("quad4, bar", rod(), false),
                ("quad4, plane strain", strain(), false),
                ("hex8, bar", hexahedra(), false),
            ];
            if courant < 0.8 {
                // Beyond its stable step: a triangle has not the best of bounds.
                cases.push(("tri3, plane strain", triangles(), true));
            }
            for (what, case, held) in cases {
                let [error, ratio] = dispersion(case, courant, half_waves, held);
                println!(
                    "{what}: C {courant}, {} elements a wave: c_num/c {ratio:.5}, off by {error:.1e}",
                    80 / half_waves
                );
                worst = worst.max(error.abs());
            }
        }
    }
    // The relation is exact for the scheme. Geometric nonlinearity at strains
    // of 1e-9 and round-off of the fit leave less than this.
    assert!(worst < 1e-7, "{worst:e}");
}
