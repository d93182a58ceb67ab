//! Discs and cylinders of many sides that roll down a slope.

use std::f64::consts::{PI, TAU};

use cdem::mesh::ElementKind;
use cdem::scene::Geometry;
use cdem_verify::{Balance, Case, fit, load, run};

const RADIUS: f64 = 0.5;

/// Acceleration of a round cylinder that does not slip, (2/3) g sin 30, m/s².
const EXACT: f64 = 2.0 / 3.0 * 4.905;

/// Corners of a regular polygon that lies on y = 0.
fn regular(sides: usize) -> Vec<[f64; 2]> {
    let half = PI / sides as f64;
    let corner = |k: usize| {
        let (sin, cos) = (half * (2 * k + 1) as f64).sin_cos();
        [RADIUS * sin, RADIUS * (half.cos() - cos)]
    };
    (0..sides).map(corner).collect()
}

/// Share of the work of gravity over a `way` that a rigid polygon keeps whose
/// corners do not rebound. About a corner it turns without loss, and on a side a
/// it gains m g a sin 30. When the next corner hits, the angular momentum about
/// that one stays: (I + m R²) ω' = (I + m R² cos(2π/n)) ω, where
/// I = m R² (2 + cos(2π/n))/6.
fn kept_without_rebound(sides: usize, way: f64) -> f64 {
    let angle = TAU / sides as f64;
    let side = 2.0 * RADIUS * (0.5 * angle).sin();
    let moment = (2.0 + angle.cos()) / 6.0;
    let keeps = ((moment + angle.cos()) / (moment + 1.0)).powi(2);
    let count = (way / side).floor();
    let energy = (0..count as usize).fold(0.0, |energy, _| keeps * (energy + side));
    energy / (count * side)
}

/// Rolls a body of so many sides, and compares it with the round one.
fn roll(case: &Case, sides: usize) {
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    let start = simulation.block_rows()[1].position;
    let (mut points, mut flying, mut slid) = (Vec::new(), 0_u32, 0.0_f64);
    run(&mut simulation, |simulation| {
        let row = balance.look(simulation);
        flying += u32::from(row.contacts == 0);
        let body = &simulation.block_rows()[1];
        let aside = body.velocity[2].hypot(RADIUS * body.angular_velocity[0]);
        slid = slid.max(aside);
        points.push((body.position[0] - start[0], body.velocity[0].powi(2)));
    });
    let (row, body) = (simulation.history(), &simulation.block_rows()[1]);
    let way = body.position[0] - start[0];
    // v² = 2 a x, from a quarter of the time on: the first sides are slow.
    let acceleration = 0.5 * fit::slope(&points[points.len() / 4..]) / EXACT;
    let kept = row.kinetic_energy / row.gravity_work;
    let least = kept_without_rebound(sides, way);
    println!(
        "{sides} sides in {}-D over {way:.3} m: acceleration {acceleration:.4} of the round one's, speed \
         {:.4}, spin {:.4}; energy kept {kept:.4}, without rebound {least:.4}; friction loss {:.1e}, \
         flies for {:.2} of the time, residual {:.1e}, rise {:.1e}",
        case.scene.dimension,
        body.velocity[0] / (EXACT * row.time),
        -RADIUS * body.angular_velocity[2] / (EXACT * row.time),
        row.friction_loss / row.gravity_work,
        f64::from(flying) / points.len() as f64,
        balance.residual,
        balance.rise,
    );
    assert!((least..=1.0).contains(&kept), "{kept}, at least {least}");
    // The share lost grows with the way, so that of the last part of it is up to
    // twice that of the whole.
    assert!(
        (acceleration - 1.0).abs() < 2.0 * (1.0 - least),
        "{acceleration}"
    );
    // It rolls: friction does next to no work, and it goes straight.
    assert!(row.friction_loss < 5e-3 * row.gravity_work, "{row:?}");
    assert!(slid < 1e-6, "{slid}");
    // 160 elements: design, section 7; 24 of the cylinder: an order below.
    assert!(
        balance.residual < 1e-3 && balance.growth < 1e-3,
        "{balance:?}"
    );
}

fn disc(sides: usize) -> Case {
    let mut case = load("rolling");
    case.block("disc").geometry = Geometry::Polygon {
        corners: regular(sides),
        size: 0.25,
        element: ElementKind::Tri3,
    };
    case
}

#[test]
fn discs_of_more_and_more_sides_roll_like_a_round_one() {
    for sides in [24, 48] {
        roll(&disc(sides), sides);
    }
}

#[test]
fn a_cylinder_rolls_like_a_round_one() {
    roll(&load("rolling-3d"), 24);
}

#[test]
#[ignore = "slow study: a disc of 96 sides"]
fn a_disc_of_many_sides_rolls_like_a_round_one() {
    roll(&disc(96), 96);
}
