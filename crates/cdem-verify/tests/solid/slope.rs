//! A cube on a slope: sliding, sticking and friction.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::Schedule;
use cdem_verify::{Case, fit, load, run};
use nalgebra::{Vector2, Vector3};

const GRAVITY: f64 = 9.81;

/// Time in which gravity grows, s, as in the scene.
const ONSET: f64 = 0.05;

/// Returns the direction of steepest descent, as in the scene.
fn downhill() -> Vector3<f64> {
    let (sin, cos) = 25.0_f64.to_radians().sin_cos();
    Vector3::new(cos, sin, 0.0)
}

fn pull(angle: f64) -> Vec<f64> {
    let (sin, cos) = angle.to_radians().sin_cos();
    let gravity = GRAVITY * (sin * downhill() - cos * Vector3::z());
    gravity.as_slice().to_vec()
}

fn slope(angle: f64, friction: f64) -> Case {
    let mut case = load("slope-3d");
    case.scene.contact.strength.friction_angle = friction.to_radians();
    case.scene.gravity = Schedule::Table(vec![(0.0, vec![0.0; 3]), (ONSET, pull(angle))]);
    case
}

/// Cubes of one element, and of more.
const CUBES: [(ElementKind, usize); 2] = [(ElementKind::Hex8, 1), (ElementKind::Tet4, 2)];

/// Returns the slopes of velocity, m/s², and displacement, m/s, of the cube over the second half of
/// the run: down the slope, across it, and normal to the base.
fn measure(case: &Case, mut look: impl FnMut(&mut Simulation) + Send) -> [Vector3<f64>; 2] {
    let mut simulation = case.start();
    let axes = [downhill(), Vector3::z().cross(&downhill()), Vector3::z()];
    let mut series: [Vec<Vec<(f64, f64)>>; 2] = [vec![Vec::new(); 3], vec![Vec::new(); 3]];
    let start = Vector3::from(simulation.block_rows()[1].position);
    run(&mut simulation, |simulation| {
        if simulation.time() > 0.5 * case.scene.time.end {
            let row = &simulation.block_rows()[1];
            let vectors = [row.velocity.into(), Vector3::from(row.position) - start];
            for (series, vector) in series.iter_mut().zip(vectors) {
                for (series, axis) in series.iter_mut().zip(axes) {
                    series.push((row.time, axis.dot(&vector)));
                }
            }
            look(simulation);
        }
    });
    println!("  penetration {:.1e}", simulation.max_penetration());
    assert_eq!(simulation.corrections().count, 0);
    series.map(|series| Vector3::from_fn(|k, _| fit::slope(&series[k])))
}

fn sliding(angle: f64, friction: f64) -> f64 {
    let (sin, cos) = angle.to_radians().sin_cos();
    GRAVITY * (sin - cos * friction.to_radians().tan())
}

#[test]
fn a_cube_slides_as_coulomb_says() {
    // Published cases; 20/0 is without friction.
    for (angle, friction, cubes) in [
        (20.0, 0.0, 1),
        (30.0, 20.0, 2),
        (40.0, 20.0, 1),
        (40.0, 30.0, 2),
        (45.0, 10.0, 1),
    ] {
        for (element, divisions) in CUBES.into_iter().take(cubes) {
            let mut case = slope(angle, friction);
            case.divide("cube", &[divisions; 3], element);
            let mut worst = 0.0_f64;
            let [found, _] = measure(&case, |simulation| {
                worst = worst.max(off_the_cone(simulation, friction));
            });
            let exact = sliding(angle, friction);
            println!(
                "{element:?}, slope {angle}, friction {friction}: {:.7}, exact {exact:.7}, \
                 across {:.1e}, up {:.1e}, off the cone {worst:.1e}",
                found[0], found[1], found[2]
            );
            // The remaining vibration of the cube in the fit: 1e-5 m/s² at most, of which 1e-6
            // along the slope.
            assert!((found[0] / exact - 1.0).abs() < 1e-5, "{found} {exact}");
            assert!(found.yz().norm() < 1e-4, "{found}");
            assert!(worst < 1e-12, "{worst}"); // round-off
        }
    }
}

/// Returns the largest difference of shear force and tan φ times the normal force of a contact,
/// over the normal force.
fn off_the_cone(simulation: &Simulation, friction: f64) -> f64 {
    let frame = simulation.contact_frame();
    let forces = frame.forces.iter().zip(&frame.normals);
    let off = forces.map(|(force, normal)| {
        let (force, normal) = (Vector3::from(*force), Vector3::from(*normal));
        let pressed = force.dot(&normal);
        let shear = (force - pressed * normal).norm();
        (shear - friction.to_radians().tan() * pressed.abs()).abs() / pressed.abs()
    });
    off.fold(0.0, f64::max)
}

/// Returns the velocity of a point under gravity and friction, m/s, down the slope and across it.
/// It has the velocity `start` as gravity begins to grow.
fn drawn(angle: f64, friction: f64, start: Vector2<f64>, end: f64) -> Vector2<f64> {
    const STEPS: u32 = 20_000;
    let (sin, cos) = angle.to_radians().sin_cos();
    let rubbed = friction.to_radians().tan() * cos;
    let rate = |time: f64, velocity: &Vector2<f64>| {
        let gravity = GRAVITY * (time / ONSET).min(1.0);
        gravity * (Vector2::new(sin, 0.0) - rubbed * velocity.normalize())
    };
    let step = end / f64::from(STEPS);
    (0..STEPS).fold(start, |velocity, k| {
        let time = f64::from(k) * step;
        let half = velocity + rate(time, &velocity) * (0.5 * step);
        velocity + rate(time + 0.5 * step, &half) * step
    })
}

#[test]
fn friction_turns_against_the_motion() {
    // Thrown across the slope, the cube turns downhill on a curve. Friction acts against the motion
    // at the end of a step, so it is of first order in time.
    let (angle, friction, speed) = (30.0, 20.0, 0.5);
    let across = Vector3::z().cross(&downhill());
    let errors = [1e-4, 5e-5].map(|step| {
        let mut case = slope(angle, friction);
        case.scene.time.step = Some(step);
        case.block("cube").velocity = (speed * across).as_slice().to_vec();
        let mut simulation = case.start();
        run(&mut simulation, |_| {});
        let row = &simulation.block_rows()[1];
        let velocity = Vector3::from(row.velocity);
        let found = Vector2::new(velocity.dot(&downhill()), velocity.dot(&across));
        let exact = drawn(angle, friction, Vector2::new(0.0, speed), row.time);
        println!("step {step}: {found:.6?}, exact {exact:.6?}");
        // Friction acts below the centre but along the motion, so it has no moment about the
        // normal.
        let spin = Vector3::from(row.angular_velocity).norm();
        assert!(spin < 1e-4, "{spin}");
        (found - exact).norm() / exact.norm()
    });
    println!("errors {errors:?}");
    assert!(errors[0] < 3e-4, "{errors:?}");
    assert!(errors[1] < 0.6 * errors[0], "{errors:?}");
}

#[test]
fn a_cube_that_may_stay_does_not_creep() {
    for (element, divisions) in CUBES {
        let mut case = slope(38.0, 40.0);
        case.divide("cube", &[divisions; 3], element);
        let [_, creep] = measure(&case, |_| {});
        println!("{element:?}: creep {:.2e} m/s", creep.norm());
        // Slope over 0.1 s of the remaining vibration of 1e-8 m.
        assert!(creep.norm() < 1e-6, "{creep}");
    }
}
