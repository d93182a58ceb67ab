//! A block under stress that rotates.

use cdem::mesh::ElementKind;
use cdem::output::Frame;
use cdem::scene::{Kinematics, Material};

use crate::plot::{Plot, Style};
use crate::problem::Findings;
use crate::{load, run, stress_of};

/// Pressure on the two ends, Pa, and the end of its ramp, s.
const PRESSURE: f64 = 40e6;
const ONSET: f64 = 0.2;

/// Length and width, m, and density, kg/m³.
const SIZE: [f64; 2] = [2.0, 1.0];
const DENSITY: f64 = 2700.0;

/// Returns the mean stress of all elements, Pa: xx, yy, zz, xy, yz, zx.
fn mean_stress(frame: &Frame) -> [f64; 6] {
    let count = frame.kinds.len() as f64;
    let rows = stress_of(frame).chunks_exact(6);
    rows.fold([0.0; 6], |sum, row| {
        std::array::from_fn(|c| sum[c] + row[c] / count)
    })
}

/// Returns the mean stress over the pressure of a bar rotated by `turn`, rad, that spins at `spin`,
/// rad/s: -p a aᵀ and, by the virial theorem, ρ ω² (L² a aᵀ + W² b bᵀ)/12.
fn virial(turn: f64, spin: f64) -> [f64; 6] {
    let (sin, cos) = turn.sin_cos();
    let of_spin = SIZE.map(|size| DENSITY * (spin * size).powi(2) / 12.0 / PRESSURE);
    let [along, across] = [of_spin[0] - 1.0, of_spin[1]];
    [
        along * cos * cos + across * sin * sin,
        along * sin * sin + across * cos * cos,
        0.0,
        (along - across) * sin * cos,
        0.0,
        0.0,
    ]
}

/// Returns the stress that damping produces from the rotation of a step, over the pressure and the
/// step. Nodes move along chords of their circle, so the bar widens at the rate ω² Δt/2 in both
/// directions.
fn stress_of_steps(rock: &Material) -> f64 {
    let ratio = rock.poisson_ratio;
    let shear = rock.young_modulus / (2.0 * (1.0 + ratio));
    let lame = 2.0 * shear * ratio / (1.0 - 2.0 * ratio);
    let spin = std::f64::consts::TAU;
    rock.damping.stiffness * (lame + shear) * spin * spin / PRESSURE
}

/// V19: a bar, pressed at its ends by pressures that rotate with it, makes one turn.
pub(super) fn stressed_block_turns() -> Findings {
    let mut findings = Findings::default();
    for (kinematics, key) in [
        (Kinematics::Total, "total"),
        (Kinematics::Incremental, "incremental"),
    ] {
        for element in [ElementKind::Hex8, ElementKind::Tet4] {
            let mut case = load("pressed-bar-turns");
            case.divide("bar", &[2, 2, 2], element);
            case.scene.block[0].kinematics = kinematics;
            let damped = stress_of_steps(&case.scene.material[0]);
            let mut simulation = case.start();
            let step = simulation.overview().step;
            let mut series = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
            let (mut turn, mut last, mut worst) = (0.0, 0.0, 0.0_f64);
            let (mut full, mut momentum) = (None, 0.0_f64);
            run(&mut simulation, |simulation| {
                let time = simulation.time();
                let spin = simulation.block_rows()[0].angular_velocity[2];
                turn += spin * (time - last);
                last = time;
                // The load is full, and the bar has stopped vibrating.
                if time < ONSET + 0.05 || !simulation.step_index().is_multiple_of(50) {
                    return;
                }
                let now = simulation.history().angular_momentum[2];
                let full = *full.get_or_insert(now);
                momentum = momentum.max((now / full - 1.0).abs());
                let (stress, exact) = (mean_stress(&simulation.frame()), virial(turn, spin));
                let found = stress.map(|s| s / PRESSURE);
                let wrong = (0..6).map(|c| (found[c] - exact[c]).abs());
                worst = wrong.fold(worst, f64::max);
                for (series, value) in series
                    .iter_mut()
                    .zip([found[0], found[1], found[3], exact[0]])
                {
                    series.push([time, value]);
                }
            });
            let of = |what: &str| format!("{}, `{key}`: {what}", element.name());
            findings
                .figure(
                    of("largest error of the mean stress, over the pressure"),
                    worst,
                )
                .at_most(
                    damped * step + 2e-6,
                    "β (λ + μ) ω² Δt: to the damping a rotation in a step is a strain rate; \
                 and strains of 1e-3 times the stress of the spin",
                );
            findings
                .figure(
                    of("change of angular momentum under full load, over its value"),
                    momentum,
                )
                .at_most(1e-10, "pressures on equal ends have no moment; round-off");
            if element == ElementKind::Hex8 && kinematics == Kinematics::Total {
                let [xx, yy, xy, exact] = series;
                let plot = Plot::new("time, s", "mean stress over the pressure")
                    .with("xx", Style::Line, xx)
                    .with("yy", Style::Line, yy)
                    .with("xy", Style::Line, xy)
                    .with("xx, exact", Style::Known, exact);
                findings.plots.push(plot);
            }
        }
    }
    findings
}
