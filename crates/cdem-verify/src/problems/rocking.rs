//! A block that rocks from corner to corner (Housner 1963).

use crate::plot::{Plot, Style};
use crate::problem::Findings;
use crate::{Balance, load, run};

/// Half the width and half the height of the block, m.
const HALF: [f64; 2] = [0.1, 0.5];
const GRAVITY: f64 = 9.81;

/// Time step of the integration of the rigid block's motion, s.
const STEP: f64 = 1e-5;

/// A rigid block about its corner, tilted by θ from upright: θ'' = -p² sin(α - θ).
struct Rigid {
    /// Angle of the diagonal with the vertical, rad.
    alpha: f64,
    /// p², 1/s².
    square: f64,
}

impl Rigid {
    fn new() -> Self {
        let [b, h] = HALF;
        Self {
            alpha: (b / h).atan(),
            square: 3.0 * GRAVITY / (4.0 * b.hypot(h)),
        }
    }

    /// Returns the potential energy over that of the block balanced on its corner; 0 if it lies
    /// flat.
    fn energy(&self, turn: f64) -> f64 {
        ((self.alpha - turn).cos() - self.alpha.cos()) / (1.0 - self.alpha.cos())
    }

    /// Returns times, s, and angles, rad, from rest at `start` until the block lies flat.
    fn fall(&self, start: f64) -> Vec<[f64; 2]> {
        let (mut turn, mut spin, mut path) = (start, 0.0, Vec::new());
        while turn > 0.0 {
            path.push([path.len() as f64 * STEP, turn]);
            spin -= 0.5 * STEP * self.square * (self.alpha - turn).sin();
            turn += STEP * spin;
            spin -= 0.5 * STEP * self.square * (self.alpha - turn).sin();
        }
        path
    }
}

/// V16: a block is tilted by half the angle of its diagonal and released.
pub(super) fn rocking_block() -> Findings {
    let mut findings = Findings::default();
    let rigid = Rigid::new();
    let start = 0.5 * rigid.alpha;
    let path = rigid.fall(start);
    let housner = (1.0 - start / rigid.alpha).recip().acosh() / rigid.square.sqrt();

    let mut simulation = load("rocking-block").start();
    let mut balance = Balance::new(&mut simulation);
    let (mut turn, mut last, mut turned) = (start, 0.0, vec![[0.0, start]]);
    run(&mut simulation, |simulation| {
        balance.look(simulation);
        let time = simulation.time();
        // A tilt to the right is clockwise.
        turn -= simulation.block_rows()[1].angular_velocity[2] * (time - last);
        last = time;
        turned.push([time, turn]);
    });
    let mut rows = simulation.ended_contacts();
    rows.extend(simulation.live_contacts());
    let left = rows.iter().filter(|row| row.position[0] < -HALF[0]);
    let landed = left.map(|row| row.time_on).fold(f64::INFINITY, f64::min);
    let exact = path.len() as f64 * STEP;
    findings
        .figure("time to the first landing, s", landed)
        .exact(
            exact,
            5e-3,
            "a rigid block; the corner of this block deforms by 1e-4 of its width",
        );
    findings
        .figure("the same, against a quarter of Housner's period", landed)
        .exact(
            housner,
            0.012,
            "Housner's angles are small: α²/6 = 0.7 %; and the corner, as above",
        );
    let farthest = turned.iter().map(|row| -row[1]).fold(0.0, f64::max);
    let kept = rigid.energy(farthest) / rigid.energy(start);
    let [b, h] = HALF;
    let sine = b / b.hypot(h);
    let housners = (1.0 - 1.5 * sine * sine).powi(2);
    findings
        .figure(
            format!("energy kept in the landing (Housner's model: {housners:.5})"),
            kept,
        )
        .between(
            housners,
            1.0,
            "in Housner's model the corner does not rebound; an elastic corner does in part",
        );
    findings.energy(str::to_owned, &balance);
    let known = path.iter().step_by(100).copied().collect();
    let plot = Plot::new("time, s", "turned by, rad")
        .with("cdem", Style::Line, turned)
        .with("a rigid block, to its landing", Style::Known, known);
    findings.plots.push(plot);
    findings
}
