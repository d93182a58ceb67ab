//! The same state takes the same path wherever it is: ties are not broken by the last digits of
//! coordinates.

use cdem_verify::{load, run};

/// Path of the cube.
struct Path {
    /// Number of elements after each step.
    elements: Vec<u64>,
    /// Its angular velocity after each step, rad/s.
    spin: Vec<[f64; 3]>,
}

/// Drops the cube, moved by `shift` m along the plane.
fn fall(shift: [f64; 2]) -> Path {
    let mut case = load("same-path");
    let place = &mut case.block("cube").translate;
    place[0] += shift[0];
    place[1] += shift[1];
    let mut simulation = case.start();
    let mut path = Path {
        elements: Vec::new(),
        spin: Vec::new(),
    };
    run(&mut simulation, |simulation| {
        path.elements.push(simulation.history().elements);
        path.spin.push(simulation.block_rows()[0].angular_velocity);
    });
    path
}

/// Checks that a shift changes neither the elements that are cut nor the motion.
fn check(path: &Path, shift: [f64; 2]) {
    let other = fall(shift);
    let spins = path.spin.iter().flatten().zip(other.spin.iter().flatten());
    let apart = spins.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let fastest = path
        .spin
        .iter()
        .flatten()
        .fold(0.0_f64, |w, x| w.max(x.abs()));
    println!("moved by {shift:?} m: spin off by {:.1e}", apart / fastest);
    assert_eq!(path.elements, other.elements, "{shift:?}");
    assert!(apart < 1e-9 * fastest, "{shift:?}: {apart:e} of {fastest}");
}

#[test]
fn a_cube_falls_alike_here_and_there() {
    let path = fall([0.0; 2]);
    let most = path.elements.iter().max();
    assert!(most > path.elements.first(), "{most:?}");
    for shift in [[0.0, 1e-14], [0.0, 1e-3], [0.1, 1.0]] {
        check(&path, shift);
    }
}
