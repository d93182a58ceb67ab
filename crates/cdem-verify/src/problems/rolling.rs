//! Polygonal discs and cylinders that roll down a slope.

use std::f64::consts::{PI, TAU};

use cdem::mesh::ElementKind;
use cdem::scene::Geometry;

use crate::plot::{Plot, Style};
use crate::problem::Findings;
use crate::{Balance, Case, fit, load, run};

const RADIUS: f64 = 0.5;

/// Acceleration of a round cylinder that rolls without slip, (2/3) g sin 30, m/s².
const ROUND: f64 = 2.0 / 3.0 * 4.905;

/// Results of a polygonal body that rolls down.
#[derive(Clone, Debug)]
pub struct Rolling {
    /// Acceleration over that of a round body. It is fitted to v² = 2 a x over the last three
    /// quarters of the time, because the first sides are slow.
    pub acceleration: f64,
    /// Kinetic energy at the end over the work of gravity.
    pub kept: f64,
    /// `kept` of a rigid body whose corners do not rebound.
    pub least: f64,
    /// Friction loss over the work of gravity.
    pub friction: f64,
    /// Largest speed across the slope, m/s.
    pub aside: f64,
    /// True for a 3-D body.
    pub in_space: bool,
    /// Momentum and energy errors of the run.
    pub balance: Balance,
    /// Times, s, and speeds, m/s.
    pub speeds: Vec<[f64; 2]>,
}

/// Returns the corners of a regular polygon that lies on y = 0.
fn regular(sides: usize) -> Vec<[f64; 2]> {
    let half = PI / sides as f64;
    let corner = |k: usize| {
        let (sin, cos) = (half * (2 * k + 1) as f64).sin_cos();
        [RADIUS * sin, RADIUS * (half.cos() - cos)]
    };
    (0..sides).map(corner).collect()
}

/// Returns the fraction of the work of gravity over a distance `way` that a rigid polygon keeps if
/// its corners do not rebound. It turns about a corner without loss and gains m g a sin 30 on a
/// side of length a. When the next corner hits, the angular momentum about that corner is
/// conserved: (I + m R²) ω' = (I + m R² cos(2π/n)) ω, where I = m R² (2 + cos(2π/n))/6.
fn kept_without_rebound(sides: usize, way: f64) -> f64 {
    let angle = TAU / sides as f64;
    let side = 2.0 * RADIUS * (0.5 * angle).sin();
    let moment = (2.0 + angle.cos()) / 6.0;
    let keeps = ((moment + angle.cos()) / (moment + 1.0)).powi(2);
    let count = (way / side).floor();
    let energy = (0..count as usize).fold(0.0, |energy, _| keeps * (energy + side));
    energy / (count * side)
}

/// Loads the scene `rolling` with a disc of `sides` sides.
#[must_use]
pub fn disc(sides: usize) -> Case {
    let mut case = load("rolling");
    case.block("disc").geometry = Geometry::Polygon {
        corners: regular(sides),
        size: 0.25,
        element: ElementKind::Tri3,
    };
    case
}

/// Rolls the second block, which has `sides` sides, down a slope of 30°.
#[must_use]
pub fn roll(case: &Case, sides: usize) -> Rolling {
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    let start = simulation.block_rows()[1].position;
    let (mut points, mut speeds, mut aside) = (Vec::new(), Vec::new(), 0.0_f64);
    run(&mut simulation, |simulation| {
        balance.look(simulation);
        let body = &simulation.block_rows()[1];
        let across = body.velocity[2].hypot(RADIUS * body.angular_velocity[0]);
        aside = aside.max(across);
        points.push((body.position[0] - start[0], body.velocity[0].powi(2)));
        speeds.push([body.time, body.velocity[0]]);
    });
    let (row, body) = (simulation.history(), &simulation.block_rows()[1]);
    Rolling {
        acceleration: 0.5 * fit::slope(&points[points.len() / 4..]) / ROUND,
        kept: row.kinetic_energy / row.gravity_work,
        least: kept_without_rebound(sides, body.position[0] - start[0]),
        friction: row.friction_loss / row.gravity_work,
        aside,
        in_space: case.scene.dimension == 3,
        balance,
        speeds,
    }
}

/// V15: discs of 24 and 48 sides, and a cylinder of 24.
pub(super) fn rolling_down() -> Findings {
    let mut findings = Findings::default();
    let round = vec![[0.0, 0.0], [0.5, 0.5 * ROUND]];
    let mut plot = Plot::new("time, s", "speed of the centre, m/s").with(
        "a round one, (2/3) g sin 30°",
        Style::Known,
        round,
    );
    for (name, case, sides) in [
        ("disc of 24 sides", disc(24), 24),
        ("disc of 48 sides", disc(48), 48),
        ("cylinder of 24 sides", load("rolling-3d"), 24),
    ] {
        let rolling = roll(&case, sides);
        add_figures(&mut findings, name, &rolling);
        plot = plot.with(name, Style::Line, rolling.speeds);
    }
    findings.plots.push(plot);
    findings
}

/// Adds the figures of a rolling body with their known values.
pub fn add_figures(findings: &mut Findings, name: &str, rolling: &Rolling) {
    let of = |what: &str| format!("{name}: {what}");
    findings
        .figure(
            of("share of the work of gravity that becomes kinetic energy"),
            rolling.kept,
        )
        .between(
            rolling.least,
            1.0,
            "between a rigid body without rebound at its corners, and a round body",
        );
    findings
        .figure(
            of("acceleration over (2/3) g sin 30°"),
            rolling.acceleration,
        )
        .between(
            1.0 - 2.0 * (1.0 - rolling.least),
            1.0,
            "never faster than a round body; the loss grows with the distance: in the last part it \
             is up to twice the mean",
        );
    findings
        .figure(
            of("work of friction over work of gravity"),
            rolling.friction,
        )
        .at_most(5e-3, "it rolls without slip");
    if rolling.in_space {
        findings
            .figure(of("speed across the slope, m/s"), rolling.aside)
            .at_most(1e-6, "it rolls straight; solves end at 1e-8 of velocities");
    }
    findings.energy(of, &rolling.balance);
}
