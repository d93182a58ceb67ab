//! Waves: the dispersion by mesh and step.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::{Boundary, BoundaryTarget, Geometry, Motion, Schedule};

use crate::plot::{Plot, Style};
use crate::problem::Findings;
use crate::{Case, load, run};

/// Returns the speeds of P and S waves in the first material, m/s.
fn wave_speeds(case: &Case) -> [f64; 2] {
    let material = &case.scene.material[0];
    let ratio = material.poisson_ratio;
    let shear = (material.young_modulus / (2.0 * (1.0 + ratio) * material.density)).sqrt();
    [
        shear * ((2.0 - 2.0 * ratio) / (1.0 - 2.0 * ratio)).sqrt(),
        shear,
    ]
}

/// A strip of 40 elements for single waves.
#[derive(Clone, Copy, Debug)]
enum Strip {
    Quadrilaterals { poisson_ratio: f64 },
    Triangles,
    Hexahedra,
}

impl Strip {
    fn name(self) -> &'static str {
        match self {
            Self::Quadrilaterals { poisson_ratio: 0.0 } => "quad4, a bar",
            Self::Quadrilaterals { .. } => "quad4, plane strain",
            Self::Triangles => "tri3, plane strain",
            Self::Hexahedra => "hex8, a bar",
        }
    }

    /// True if velocities at both ends are prescribed (sine waves), false if both are free (cosine
    /// waves).
    fn is_held(self) -> bool {
        matches!(self, Self::Triangles)
    }

    fn case(self) -> Case {
        let mut case = load("wave-in-strip");
        match self {
            Self::Quadrilaterals { poisson_ratio } => {
                case.scene.material[0].poisson_ratio = poisson_ratio;
                case.divide("strip", &[40, 1], ElementKind::Quad4);
            }
            Self::Triangles => {
                case.scene.block[0].geometry = Geometry::Mesh {
                    path: "triangles.msh".into(),
                    group: None,
                };
                let held = ["left", "right"].map(|group| Boundary {
                    target: BoundaryTarget::Group(group.to_owned()),
                    motion: Motion::Velocity([Some(Schedule::Constant(0.0)), None, None]),
                    start: 0.0,
                    end: None,
                });
                case.scene.boundary.extend(held);
            }
            Self::Hexahedra => {
                let mut probe = case.scene.probe.swap_remove(0);
                probe.point = vec![0.0; 3];
                case = load("wave-in-bar-3d");
                case.scene.probe = vec![probe];
            }
        }
        case
    }
}

/// Returns ωΔt of a vibration from the displacements of one node. Central differences of a single
/// mode satisfy u₊ + u₋ = 2 cos(ωΔt) u.
fn phase(mut simulation: Simulation) -> f64 {
    let mut path = vec![0.0];
    run(&mut simulation, |simulation| {
        path.push(simulation.probe_rows()[0].displacement[0]);
    });
    let (mut above, mut below) = (0.0, 0.0);
    for window in path.windows(3) {
        above += (window[0] + window[2]) * window[1];
        below += 2.0 * window[1] * window[1];
    }
    (above / below).acos()
}

/// Returns the speed of a single wave over that of long waves: by the dispersion relation, and
/// computed.
fn dispersion(strip: Strip, courant: f64, half_waves: usize) -> [f64; 2] {
    const CELLS: f64 = 40.0;
    let mut case = strip.case();
    let (speed, length) = (wave_speeds(&case)[0], 10.0);
    let size = length / CELLS;
    let step = courant * size / speed;
    case.scene.load.clear();
    case.scene.time.step = Some(step);
    case.scene.time.end = 400.0 * step;
    case.scene.probe.truncate(1);
    // At a free end, or one element from a fixed end: none of the waves is zero there.
    case.scene.probe[0].point[0] = if strip.is_held() { size } else { 0.0 };
    let wave_number = half_waves as f64 * std::f64::consts::PI / length;
    let mut simulation = case.start();
    assert_eq!(simulation.overview().levels.len(), 1, "one step for all");
    // Strains of 1e-9, so that nonlinearity and round-off are far below the measured effect.
    simulation.set_initial_velocities(&|at| {
        let phase = wave_number * at[0];
        let shape = if strip.is_held() {
            phase.sin()
        } else {
            phase.cos()
        };
        [1e-9 * speed * shape, 0.0, 0.0]
    });
    let exact = 2.0 * (courant * (0.5 * wave_number * size).sin()).asin();
    let long = wave_number * speed * step;
    [exact / long, phase(simulation) / long]
}

/// V5: single waves in strips of lumped masses, by central differences.
pub(super) fn single_waves() -> Findings {
    const EXACT: &str = "exact for the scheme; strains of 1e-9, and round-off of the fit";
    let mut findings = Findings::default();
    let mut plot = Plot::new("elements a wave", "speed over that of long waves");
    for courant in [0.5, 0.9] {
        let relation = |half_waves: f64| {
            let x = 0.5 * half_waves * std::f64::consts::PI / 40.0;
            [
                80.0 / half_waves,
                (courant * x.sin()).asin() / (courant * x),
            ]
        };
        let curve = (0..=60).map(|k| relation(4.0 + 0.2 * f64::from(k)));
        let name = format!("sin(ωΔt/2) = C sin(kh/2), C = {courant}");
        plot = plot.with(&name, Style::Known, curve.collect());
        let mut dots = Vec::new();
        for strip in [
            Strip::Quadrilaterals { poisson_ratio: 0.0 },
            Strip::Quadrilaterals {
                poisson_ratio: 0.25,
            },
            Strip::Hexahedra,
            Strip::Triangles,
        ] {
            // Above the stable step of the triangles, whose stability limit is lower.
            if courant > 0.8 && strip.is_held() {
                continue;
            }
            let mut worst = 0.0_f64;
            for half_waves in [4, 8, 16] {
                let [exact, found] = dispersion(strip, courant, half_waves);
                worst = worst.max((found / exact - 1.0).abs());
                let elements = 80 / half_waves;
                dots.push([elements as f64, found]);
            }
            findings
                .figure(
                    format!(
                        "{}, C = {courant}, 5 to 20 elements a wave: largest error of the speed",
                        strip.name()
                    ),
                    worst,
                )
                .at_most(1e-7, EXACT);
        }
        plot = plot.with(&format!("cdem, C = {courant}"), Style::Dots, dots);
    }
    findings.plots.push(plot);
    findings
}

/// V6: pulses of pressure and of shear in steel.
pub(super) fn pulses_in_steel() -> Findings {
    let mut findings = Findings::default();
    let case = load("waves-in-steel");
    let exact = wave_speeds(&case);
    let mut simulation = case.start();
    let mut series = vec![Vec::new(); 4];
    run(&mut simulation, |simulation| {
        for (k, (row, series)) in simulation.probe_rows().iter().zip(&mut series).enumerate() {
            // The pressed strip moves along its axis, the sheared strip across it.
            series.push([row.time, row.velocity[usize::from(k >= 2)]]);
        }
    });
    // The mean time of a pulse at a probe is that of its longest waves, which the mesh does not
    // disperse.
    let mean_time = |series: &[[f64; 2]]| {
        let sums = series
            .iter()
            .fold([0.0; 2], |[sum, moment], [time, velocity]| {
                [sum + velocity, moment + velocity * time]
            });
        sums[1] / sums[0]
    };
    let mut plot = Plot::new("time, ms", "velocity over the largest of the first probe");
    for (wave, name) in ["P", "S"].into_iter().enumerate() {
        let [near, far] = [&series[2 * wave], &series[2 * wave + 1]];
        let speed = 1.0 / (mean_time(far) - mean_time(near));
        findings
            .figure(format!("speed of the {name} wave, m/s"), speed)
            .exact(
                exact[wave],
                1e-3,
                "mean times are those of the longest waves; the run ends before the shorter ones",
            );
        let largest = near.iter().map(|row| row[1].abs()).fold(0.0, f64::max);
        for (place, series) in [("0.5 m", near), ("1.5 m", far)] {
            let scaled = series.iter().map(|[t, v]| [1e3 * t, v / largest]);
            plot = plot.with(&format!("{name} at {place}"), Style::Line, scaled.collect());
        }
    }
    findings.plots.push(plot);
    findings
}
