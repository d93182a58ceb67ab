//! The larger block of a collision takes part as far as waves get in it, not as a whole.

use cdem::scene::{Geometry, Schedule};
use cdem_verify::{Case, Random, load, run};

/// Motion and loss of a stone after its touch with the ground.
#[derive(Debug)]
struct Rebound {
    /// Angular velocity, rad/s.
    spin: f64,
    /// Impact loss over the energy of the fall.
    loss: f64,
    elements: u64,
}

/// Sets the length of the ground, m.
fn lengthen(case: &mut Case, length: usize) {
    let Geometry::Box {
        min,
        max,
        divisions,
        ..
    } = &mut case.block("ground").geometry
    else {
        panic!("the ground is a box");
    };
    (min[0], max[0]) = (-0.5 * length as f64, 0.5 * length as f64);
    divisions[0] = length;
}

/// Drops the stone of a case on a ground of this length, m.
fn fall(mut case: Case, length: usize) -> Rebound {
    lengthen(&mut case, length);
    let mut simulation = case.start();
    let start = simulation.history();
    let mut added = 0;
    run(&mut simulation, |simulation| {
        added = added.max(simulation.history().elements - start.elements);
    });
    let end = simulation.history();
    Rebound {
        spin: simulation.block_rows()[0].angular_velocity[2],
        loss: end.impact_loss / (start.kinetic_energy + end.gravity_work),
        elements: added,
    }
}

/// Checks that the rebound on a ground of this length, m, is that on one of 20 m.
fn check(case: impl Fn() -> Case, length: usize) {
    let [short, long] = [20, length].map(|length| fall(case(), length));
    println!("20 m: {short:?}; {length} m: {long:?}");
    assert!(short.elements > 0, "{short:?}");
    // A change of step may change the moment of a cut.
    let change = long.elements.abs_diff(short.elements);
    assert!(change * 20 <= short.elements, "{long:?} {short:?}");
    // Small changes of a small loss or spin count less.
    let is_like =
        |one: f64, other: f64, least: f64| (one - other).abs() < 0.01 * other.abs().max(least);
    assert!(is_like(long.spin, short.spin, 0.1), "{long:?} {short:?}");
    assert!(is_like(long.loss, short.loss, 1e-3), "{long:?} {short:?}");
}

#[test]
fn the_length_of_the_ground_does_not_matter() {
    check(|| load("long-ground"), 80);
}

/// A stone of any modulus, size, tilt and speed, just above the ground. The run ends before waves
/// come back from the ends of a ground of 20 m. Without gravity no others start there.
fn any_fall(random: &mut Random) -> Case {
    let mut case = load("long-ground");
    let modulus = 10_f64.powf(random.between(8.0, 10.7));
    let size = random.between(0.5, 1.5);
    let speed = random.between(1.0, 8.0);
    case.scene.gravity = Schedule::Constant(vec![0.0; 2]);
    case.scene.material[0].young_modulus = modulus;
    let wave_speed = (1.2 * modulus / case.scene.material[0].density).sqrt();
    let stone = case.block("stone");
    if let Geometry::Box { min, max, .. } = &mut stone.geometry {
        *min = vec![-0.5 * size; 2];
        *max = vec![0.5 * size; 2];
    }
    let angle = random.between(3.0, 42.0).to_radians();
    stone.rotate.angle = angle;
    stone.velocity = vec![random.between(-0.3, 0.3) * speed, -speed];
    let gap = 0.02 * size;
    let below = 0.5 * size * (angle.sin() + angle.cos());
    stone.translate = vec![random.between(-0.5, 0.5), below + gap];
    case.scene.time.end = gap / speed + 16.0 / wave_speed;
    case
}

#[test]
#[ignore = "slow study: two hundred grounds of up to 100 m"]
fn no_length_of_the_ground_matters() {
    for seed in 0..200 {
        let mut random = Random(seed);
        let length = random.whole(24, 100);
        check(|| any_fall(&mut Random(seed + 1000)), length);
    }
}
