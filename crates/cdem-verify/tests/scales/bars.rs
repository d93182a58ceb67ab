//! Flush bars of unequal impedances on two scales: the force of wave theory.

use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Mass, Zone};
use cdem_verify::{Balance, load, run};

const DENSITY: f64 = 2700.0;
const YOUNG_MODULUS: f64 = 40e9;
const SPEED: f64 = 3.0;
const LENGTH: f64 = 10.0;
/// They start 1 cm apart.
const TOUCH: f64 = 0.01 / SPEED;

/// A contact, in transits of waves through an element of the unrefined mesh.
struct Outcome {
    /// Times after the touch, and the impulse until then over that of wave theory.
    impulse: Vec<[f64; 2]>,
    /// Mean force of each transit over that of wave theory.
    force: Vec<f64>,
    elements: u64,
    residual: f64,
}

/// Two bars whose impedances are as 1 : `ratio`, of square elements, `rows` across.
fn collide(ratio: f64, rows: usize, element: ElementKind, zone: Zone) -> Outcome {
    let mut case = load("unequal-bars");
    let contact = &mut case.scene.contact;
    contact.model = ContactModel::TwoScale;
    contact.tolerance = None;
    contact.zone = zone;
    case.scene.material[1].density = DENSITY * ratio * ratio;
    case.divide("left", &[10 * rows, rows], element);
    case.divide("right", &[5 * rows, rows], element);
    for block in &mut case.scene.block {
        block.mass = Mass::Auto;
    }
    let light = (DENSITY * YOUNG_MODULUS).sqrt();
    let exact = SPEED * light * ratio / (1.0 + ratio);
    let transit = LENGTH / (10 * rows) as f64 / (YOUNG_MODULUS / DENSITY).sqrt();
    let mut simulation = case.start();
    let step = simulation.overview().step;
    let mut balance = Balance::new(&mut simulation);
    let (mut elements, mut sum) = (0, 0.0);
    let mut impulse = vec![[0.0; 2]];
    run(&mut simulation, |simulation| {
        elements = elements.max(balance.look(simulation).elements);
        sum += simulation.block_rows()[1].force[0] * step / exact / transit;
        let elapsed = simulation.time() - TOUCH;
        if elapsed > 0.0 {
            impulse.push([elapsed / transit, sum]);
        }
    });
    let until = |time: f64| {
        let after = impulse.partition_point(|row| row[0] < time).max(1);
        let [[t0, sum0], [t1, sum1]] = [impulse[after - 1], impulse[after]];
        sum0 + (sum1 - sum0) * (time - t0) / (t1 - t0)
    };
    // Three quarters of the contact: its end is spread over some elements.
    let transits = 15 * rows;
    let force = (1..=transits).map(|n| until(n as f64) - until((n - 1) as f64));
    Outcome {
        force: force.collect(),
        impulse: impulse
            .into_iter()
            .filter(|row| row[0] <= transits as f64)
            .collect(),
        elements,
        residual: balance.residual,
    }
}

/// Both sides are refined to equal transit times, so that the touch makes the velocity of
/// wave theory at once (design, section 6).
#[test]
fn unequal_bars_give_the_force_of_wave_theory() {
    for zone in [Zone::Graded, Zone::Wavefront] {
        for (ratio, rows, element) in [
            (2.0, 1, ElementKind::Quad4),
            (2.0, 2, ElementKind::Quad4),
            (10.0, 1, ElementKind::Quad4),
            (10.0, 2, ElementKind::Tri3),
        ] {
            let outcome = collide(ratio, rows, element, zone);
            println!(
                "{zone:?}, 1 : {ratio}, {rows} {element:?}: {} elements, residual {:.1e}, force \
                 {:.3?}",
                outcome.elements, outcome.residual, outcome.force
            );
            // The touch joins half an element of each, which then move on without force: a
            // deficit of at most a twentieth of a transit, that does not grow.
            for [time, impulse] in outcome.impulse.iter().filter(|row| row[0] >= 2.5) {
                let mean = impulse / time;
                assert!((mean - 1.0).abs() < 0.02, "{time}: {mean}");
            }
        }
    }
}
