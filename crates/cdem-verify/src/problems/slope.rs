//! Blocks on a slope that slide, stick or topple.

use cdem::Simulation;
use cdem::scene::Schedule;

use crate::plot::{Plot, Style};
use crate::problem::Findings;
use crate::{Case, fit, load, run};

const GRAVITY: f64 = 9.81;

/// Loads the scene `slope`, with angles in degrees.
#[must_use]
pub fn slope(angle: f64, friction: f64) -> Case {
    let mut case = load("slope");
    case.scene.contact.strength.friction_angle = friction.to_radians();
    case.scene.gravity = Schedule::Constant(pull(angle));
    case
}

/// Returns gravity in the frame of the slope, m/s².
fn pull(angle: f64) -> Vec<f64> {
    let (sin, cos) = angle.to_radians().sin_cos();
    vec![GRAVITY * sin, -GRAVITY * cos]
}

/// Returns the acceleration of a rigid block that slides, m/s².
#[must_use]
pub fn sliding(angle: f64, friction: f64) -> f64 {
    let (sin, cos) = angle.to_radians().sin_cos();
    GRAVITY * (sin - cos * friction.to_radians().tan())
}

/// Returns the slopes over time of velocity, m/s², and displacement, m/s, of the last block along
/// the incline, in the second half of the run.
///
/// # Panics
/// If there is no block.
pub fn measure(case: &Case, mut look: impl FnMut(&mut Simulation) + Send) -> [f64; 2] {
    let mut simulation = case.start();
    let (mut velocity, mut displacement) = (Vec::new(), Vec::new());
    run(&mut simulation, |simulation| {
        if simulation.step_index().is_multiple_of(20)
            && simulation.time() > 0.5 * case.scene.time.end
        {
            let rows = simulation.block_rows();
            let block = rows.last().expect("there is a block");
            velocity.push((block.time, block.velocity[0]));
            displacement.push((block.time, block.position[0]));
            look(simulation);
        }
    });
    [fit::slope(&velocity), fit::slope(&displacement)]
}

/// V12: a block on a slope.
pub(super) fn block_on_slope() -> Findings {
    let mut findings = Findings::default();
    // Published cases; 20/0 is without friction.
    for (angle, friction) in [
        (20.0, 0.0),
        (30.0, 20.0),
        (40.0, 20.0),
        (40.0, 30.0),
        (45.0, 10.0),
    ] {
        let [found, _] = measure(&slope(angle, friction), |_| {});
        findings
            .figure(
                format!("slope of {angle}°, friction of {friction}°: acceleration, m/s²"),
                found,
            )
            .exact(
                sliding(angle, friction),
                1e-4,
                "the rest of the block's vibration in the fit: 4e-5 at most",
            );
    }
    let mut case = slope(30.0, 40.0);
    case.scene.gravity = Schedule::Table(vec![(0.0, vec![0.0, 0.0]), (0.1, pull(30.0))]);
    case.scene.time.end = 0.6;
    let [_, creep] = measure(&case, |_| {});
    findings
        .figure("slope of 30°, friction of 40°: creep, m/s", creep)
        .at_most(1e-7, "vibration of 1e-8 m at the ends of 0.3 s");
    findings
}

/// A rigid block of width `across` and height `up`, m, that topples about its lower corner on a
/// slope of `angle` degrees.
struct Toppling {
    angle: f64,
    across: f64,
    up: f64,
}

impl Toppling {
    /// Returns times and angles of rotation at `steps` equal steps, under gravity of `gravity(t)`
    /// m/s². Integrates θ'' = M(θ)/I by the fourth-order Runge-Kutta method.
    fn turns(&self, step: f64, steps: usize, gravity: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        let radius = 0.5 * self.across.hypot(self.up);
        let inertia = 4.0 / 3.0 * radius * radius;
        // Angle of the centre from the vertical above the corner, up the slope.
        let lean = (self.across / self.up).atan() - self.angle.to_radians();
        let rate = |time: f64, turn: f64| gravity(time) * radius / inertia * (turn - lean).sin();
        let (mut turn, mut spin, mut path) = (0.0, 0.0, Vec::new());
        for k in 0..steps {
            let time = k as f64 * step;
            path.push([time, turn]);
            let (v1, a1) = (spin, rate(time, turn));
            let half = 0.5 * step;
            let (v2, a2) = (spin + half * a1, rate(time + half, turn + half * v1));
            let (v3, a3) = (spin + half * a2, rate(time + half, turn + half * v2));
            let (v4, a4) = (spin + step * a3, rate(time + step, turn + step * v3));
            turn += step / 6.0 * (v1 + 2.0 * (v2 + v3) + v4);
            spin += step / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
        }
        path
    }
}

/// V13: three blocks of equal width on a slope of 40°: one stays, one slides and one topples.
pub(super) fn slide_or_topple() -> Findings {
    const ANGLE: f64 = 40.0;
    const ONSET: f64 = 0.5;
    const PULL: f64 = 10.0;
    let mut findings = Findings::default();
    let case = load("slide-or-topple");
    let mut simulation = case.start();
    let mut turns = vec![0.0; 4];
    let (mut turned, mut slid, mut stayed) = (Vec::new(), Vec::new(), Vec::new());
    let mut last = 0.0;
    run(&mut simulation, |simulation| {
        let rows = simulation.block_rows();
        let time = simulation.time();
        for (row, turn) in rows.iter().zip(&mut turns) {
            *turn -= row.angular_velocity[2] * (time - last);
        }
        last = time;
        turned.push([time, turns[3]]);
        if time > ONSET {
            slid.push((time, rows[2].velocity[0]));
        }
        if time > 3.0 * ONSET {
            stayed.push((time, rows[1].position[0]));
        }
    });
    let (sin, cos) = ANGLE.to_radians().sin_cos();
    findings
        .figure(
            "10 m high, friction of 40.1°: creep, m/s",
            fit::slope(&stayed),
        )
        .at_most(
            1e-6,
            "a rigid block has none; displacements of 1e-7 m over the last half second",
        );
    findings
        .figure("10 m high, friction of 40.1°: rotation, rad", turns[1])
        .at_most(
            1e-4,
            "shear and bending, ρ g h/E = 2e-5 each and more; it stays upright",
        );
    findings
        .figure(
            "5 m high, friction of 20°: acceleration, m/s²",
            fit::slope(&slid),
        )
        .exact(
            PULL * (sin - cos * 20.0_f64.to_radians().tan()),
            1e-4,
            "the rest of its vibration in the fit, as in V12",
        );
    findings
        .figure("5 m high, friction of 20°: rotation, rad", turns[2])
        .at_most(1e-4, "it slides without rotation");
    let toppling = Toppling {
        angle: ANGLE,
        across: 10.0,
        up: 25.0,
    };
    let step = last / 2000.0;
    let exact = toppling.turns(step, 2001, |time| PULL * (time / ONSET).min(1.0));
    findings
        .figure(
            format!("25 m high, friction of 40°: rotation within {last:.1} s, rad"),
            turns[3],
        )
        .exact(
            exact[exact.len() - 1][1],
            0.02,
            "a rigid block about its corner; this block bends and its corner deforms",
        );
    let plot = Plot::new("time, s", "turned by, rad")
        .with("cdem, 25 m", Style::Line, turned)
        .with("a rigid block", Style::Known, exact);
    findings.plots.push(plot);
    findings
}
