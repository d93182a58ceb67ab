//! Elastic balls: Hertz's impact.

use cdem::Overview;

use crate::halving::halve;
use crate::plot::{Plot, Style};
use crate::problem::Findings;
use crate::problems::ball::Ball;
use crate::{Balance, load, run};

/// The ball of the scenes, at its speed before a wall. Of two balls, each contributes half of the
/// approach.
pub const BALL: Ball = Ball {
    radius: 0.1,
    young_modulus: 70e9,
    poisson_ratio: 0.3,
    density: 2699.0,
    speed: 1.0,
};

/// Results of a run, over Hertz's values.
#[derive(Clone, Debug)]
pub struct Impact {
    /// Contact time.
    pub duration: f64,
    /// Peak force.
    pub peak: f64,
    /// Mass of the mesh over the mass of the ball.
    pub mass: f64,
    /// Impulse over 2 m v of the mesh.
    pub impulse: f64,
    /// Relative speed of the centres after the impact, over that before.
    pub restitution: f64,
    /// Impact loss of first touches, over the kinetic energy at the start.
    pub loss: f64,
    /// Momentum and energy errors of the run.
    pub balance: Balance,
    /// Deepest penetration, m.
    pub penetration: f64,
    /// Times after the first touch over the contact time, and forces over the peak.
    pub forces: Vec<[f64; 2]>,
    /// Overview of the run at its start.
    pub overview: Overview,
}

/// Projects a point onto the upper or the lower ball.
fn on_ball(point: [f64; 3]) -> [f64; 3] {
    let centre = BALL.radius.copysign(point[2]);
    let from = [point[0], point[1], point[2] - centre];
    let length = from.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z] = from.map(|x| x * BALL.radius / length);
    [x, y, z + centre]
}

/// Runs the scene `hertz-wall` or `hertz-pair` with the edges of its mesh halved `halvings` times.
#[must_use]
pub fn meet(name: &str, halvings: usize) -> Impact {
    let case = load(name);
    let mut simulation =
        case.start_from(|mesh| (0..halvings).fold(mesh, |mesh, _| halve(mesh, on_ball)));
    let overview = simulation.overview();
    let before = simulation.block_rows();
    let energy = simulation.history().kinetic_energy;
    let [time, force] = BALL.hertz();
    let mut balance = Balance::new(&mut simulation);
    let (mut forces, mut impulse) = (Vec::new(), 0.0);
    run(&mut simulation, |simulation| {
        balance.look(simulation);
        let now = 4.0 * simulation.block_rows()[0].force[2];
        forces.push([simulation.time(), now / force]);
        impulse += now * overview.step;
    });
    let mut rows = simulation.ended_contacts();
    rows.extend(simulation.live_contacts());
    let starts = rows.iter().map(|row| row.time_on);
    let first = starts.fold(f64::INFINITY, f64::min);
    let ends = rows.iter().map(|row| row.time_off.unwrap_or(f64::INFINITY));
    let last = ends.fold(0.0, f64::max);
    let after = simulation.block_rows();
    let relative = |rows: &[cdem::output::BlockRow]| rows[0].velocity[2] - rows[1].velocity[2];
    Impact {
        duration: (last - first) / time,
        peak: forces.iter().map(|row| row[1]).fold(0.0, f64::max),
        mass: 4.0 * before[0].mass / BALL.mass(),
        impulse: impulse / (8.0 * before[0].mass * BALL.speed),
        restitution: -relative(&after) / relative(&before),
        loss: simulation.history().impact_loss / energy,
        balance,
        penetration: simulation.max_penetration(),
        forces: forces
            .into_iter()
            .map(|[at, force]| [(at - first) / time, force])
            .collect(),
        overview,
    }
}

/// Returns Hertz's force over its peak against time over the contact time. Integrates m a'' = -F(a)
/// in units in which its coefficients are 1.
fn hertz_curve() -> Vec<[f64; 2]> {
    const STEP: f64 = 1e-3;
    let (mut approach, mut speed, mut curve) = (0.0_f64, 1.0_f64, Vec::new());
    while approach >= 0.0 {
        curve.push([curve.len() as f64 * STEP, approach.powf(1.5)]);
        speed -= 0.5 * STEP * approach.powf(1.5);
        approach += STEP * speed;
        speed -= 0.5 * STEP * approach.max(0.0).powf(1.5);
    }
    let peak = curve.iter().map(|row| row[1]).fold(0.0, f64::max);
    let end = curve.len() as f64 * STEP;
    curve.iter().map(|[t, f]| [t / end, f / peak]).collect()
}

/// V9: an elastic ball hits a rigid wall.
pub(super) fn ball_on_wall() -> Findings {
    const ELASTIC: &str = "small masses at the touch lose almost nothing";
    let mut findings = Findings::default();
    let impact = meet("hertz-wall", 0);
    let [time, force] = BALL.beyond_hertz();
    let [hertz_time, hertz_force] = BALL.hertz();
    findings
        .figure("contact time, s", impact.duration * hertz_time)
        .exact(
            time * hertz_time,
            0.06,
            "study: 5.4 % from the limit of finer meshes, which is 0.6 % from this",
        );
    findings
        .figure("peak force, N", impact.peak * hertz_force)
        .exact(
            force * hertz_force,
            0.03,
            "study: 2.4 % from the limit of finer meshes, which is 0.6 % from this",
        );
    findings
        .figure("impulse over 2 m v", impact.impulse)
        .exact(1.0, 1e-3, ELASTIC);
    findings
        .figure("restitution", impact.restitution)
        .exact(1.0, 1e-3, ELASTIC);
    findings
        .figure("energy of first touches, over the energy", impact.loss)
        .at_most(1e-3, ELASTIC);
    findings.energy(str::to_owned, &impact.balance);
    findings
        .figure("deepest penetration, m", impact.penetration)
        .at_most(1.8e-7, "a thousandth of the approach");
    let plot = Plot::new("time over Hertz's contact time", "force over Hertz's peak")
        .with("cdem", Style::Line, impact.forces)
        .with("Hertz", Style::Known, hertz_curve());
    findings.plots.push(plot);
    findings
}
