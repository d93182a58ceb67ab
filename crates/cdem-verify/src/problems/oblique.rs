//! A ball that hits a wall obliquely and slides throughout its impact.

use crate::plot::{Plot, Style};
use crate::problem::{Findings, LEDGER, LEDGER_LIMIT};
use crate::{Balance, Case, load, run};

/// Radius of the ball, m.
const RADIUS: f64 = 0.1;

/// Results of an impact with some speed along the wall, and 1 m/s normal to it.
struct ObliqueImpact {
    restitution: f64,
    /// Loss of speed along the wall, m/s.
    slowed: f64,
    /// Spin in the direction of rolling, rad/s.
    spin: f64,
    /// Friction loss over the energy at the start.
    friction_loss: f64,
    balance: Balance,
}

fn meet(mut case: Case, along: f64) -> ObliqueImpact {
    case.block("ball").velocity = vec![along, 0.0, -1.0];
    let mut simulation = case.start();
    let energy = simulation.history().kinetic_energy;
    let mut balance = Balance::new(&mut simulation);
    run(&mut simulation, |simulation| {
        balance.look(simulation);
    });
    let ball = &simulation.block_rows()[0];
    let way = along.signum();
    ObliqueImpact {
        restitution: ball.velocity[2],
        slowed: way * (along - ball.velocity[0]),
        spin: way * ball.angular_velocity[1],
        friction_loss: simulation.history().friction_loss / energy,
        balance,
    }
}

/// Returns the mass of the mesh, kg, and its moment of inertia about y, kg·m².
fn inertia(mut case: Case) -> [f64; 2] {
    case.block("ball").velocity = vec![0.0; 3];
    case.block("ball").angular_velocity = vec![0.0, 1.0, 0.0];
    let mut simulation = case.start();
    let ball = &simulation.block_rows()[0];
    let [mass, spin] = [ball.mass, ball.angular_velocity[1]];
    [mass, simulation.history().angular_momentum[1] / spin]
}

/// V10: an elastic ball hits a rigid wall at several angles.
pub(super) fn oblique_ball() -> Findings {
    let mut findings = Findings::default();
    let case = load("oblique-ball");
    let friction = case.scene.contact.strength.friction_angle.tan();
    let [mass, moment] = inertia(case.clone());
    findings
        .figure(
            "moment of inertia of the mesh over (2/5) m R²",
            moment / (0.4 * mass * RADIUS * RADIUS),
        )
        .exact(1.0, 0.02, "flat faces of up to 18 mm on a round ball");
    let (mut slides, mut spins, mut residual) = (Vec::new(), Vec::new(), 0.0_f64);
    for angle in [45.0, 60.0, 70.0] {
        let along = f64::to_radians(angle).tan();
        // The mesh's centre of mass is not exactly above the contact point. The error changes sign
        // with the direction along the wall, so the mean of both directions is taken.
        let both = [along, -along].map(|along| meet(case.clone(), along));
        let mean = |of: fn(&ObliqueImpact) -> f64| 0.5 * (of(&both[0]) + of(&both[1]));
        let restitution = mean(|impact| impact.restitution);
        let (slowed, spin) = (mean(|impact| impact.slowed), mean(|impact| impact.spin));
        let of = |what: &str| format!("{angle}°: {what}");
        findings.figure(of("restitution"), restitution).exact(
            1.0,
            2e-3,
            "elastic; friction moves some energy from one motion to the other",
        );
        findings
            .figure(
                of("change of speed along the wall over that across it"),
                slowed / (1.0 + restitution),
            )
            .exact(
                friction,
                1e-3,
                "Coulomb's law at every instant; points of the rim may stick at the end",
            );
        let taken = 2.0 * friction;
        let rolling = taken * mass * RADIUS / moment;
        findings.figure(of("spin, rad/s"), spin).exact(
            rolling,
            0.01,
            "the centre comes nearer by 0.2 % of R, and the contact moves along by as much",
        );
        findings
            .figure(
                of("difference of the spins of the two directions, over their sum"),
                (both[0].spin - both[1].spin) / (2.0 * spin),
            )
            .at_most(
                0.03,
                "the centre of mass of the mesh is some 0.1 mm off the axis of the pole, of μ R = 10 mm",
            );
        let sliding = along - 0.5 * taken - 0.5 * rolling * RADIUS;
        findings
            .figure(
                of("work of friction over the energy"),
                mean(|impact| impact.friction_loss),
            )
            .exact(
                taken * sliding / (0.5 * (1.0 + along * along)),
                0.01,
                "impulse times the mean of the sliding speeds before and after; tolerance of the spin",
            );
        for impact in &both {
            residual = residual.max(impact.balance.residual);
        }
        slides.push([angle, slowed]);
        spins.push([angle, spin * RADIUS]);
    }
    findings
        .figure("energy residual, over the energy exchanged", residual)
        .at_most(LEDGER_LIMIT, LEDGER);
    let known = |speed: f64| vec![[45.0, speed], [70.0, speed]];
    let plot = Plot::new(
        "angle of incidence, degrees",
        "change over the speed across the wall",
    )
    .with("change of speed along the wall", Style::Dots, slides)
    .with("spin times radius", Style::Dots, spins)
    .with("2 μ, of e = 1", Style::Known, known(2.0 * friction))
    .with("5 μ", Style::Known, known(5.0 * friction));
    findings.plots.push(plot);
    findings
}
