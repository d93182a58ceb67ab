//! Impacts of two small blocks: corner to corner, corner to edge, and into a notch.

use cdem::mesh::ElementKind;
use cdem::scene::{Geometry, Mass};
use cdem_verify::{Case, Random, load, run};

use crate::many::meet;

/// Runs and checks; returns the number of contacts begun.
fn check(case: &Case, what: &str) -> u64 {
    let (balance, overlap, begun) = meet(case);
    assert!(balance.momentum < 1e-12, "{what}: {balance:?}");
    assert!(balance.angular_momentum < 1e-12, "{what}: {balance:?}");
    // Limit of the ledger for unrefined blocks of one element.
    assert!(balance.residual < 2e-2, "{what}: {balance:?}");
    assert!(balance.growth < 2e-2, "{what}: {balance:?}");
    assert!(overlap <= 1.0, "{what}: {overlap} tolerances deep");
    begun
}

#[test]
fn corners_that_meet_head_on_do_not_pass() {
    let begun = check(&load("corner-hits"), "as the scene says");
    assert!(begun > 0);
    for offset in [1e-12, 1e-9, 1e-6, 1e-4, -1e-9, -1e-4, 0.01] {
        let mut case = load("corner-hits");
        case.block("square").translate[1] = offset;
        assert!(check(&case, &format!("{offset:e} off the middle")) > 0);
    }
}

#[test]
fn blocks_thrown_at_each_other_any_way_do_not_pass() {
    let mut random = Random(7);
    let mut met = 0;
    for number in 0..60 {
        let mut case = load("corner-hits");
        case.scene.time.end = 0.12;
        let corners = random.polygon([0.0, 0.0], 0.7, 3);
        let triangle = case.block("triangle");
        triangle.geometry = Geometry::Polygon {
            corners,
            size: 10.0,
            element: ElementKind::Tri3,
        };
        triangle.translate = vec![-0.8, random.between(-0.5, 0.5)];
        triangle.angular_velocity = vec![random.between(-5.0, 5.0)];
        triangle.mass = Mass::Consistent;
        let square = case.block("square");
        square.rotate.angle = random.between(0.0, 6.3);
        let turn = square.rotate.angle;
        // Moves the square's centre to (0.8, y).
        let centre = [turn.cos() - turn.sin(), turn.cos() + turn.sin()].map(|x| 0.5 * x);
        square.translate = vec![0.8 - centre[0], random.between(-0.5, 0.5) - centre[1]];
        met += u64::from(check(&case, &format!("throw {number}")) > 0);
    }
    println!("{met} of 60 met");
    assert!(met > 45);
}

#[test]
fn a_notch_catches_a_triangle() {
    assert!(check(&load("notch"), "an L") > 0);
    let mut case = load("notch");
    let plus: Vec<[f64; 2]> = vec![
        [-0.3, -1.0],
        [0.3, -1.0],
        [0.3, -0.3],
        [1.0, -0.3],
        [1.0, 0.3],
        [0.3, 0.3],
        [0.3, 1.0],
        [-0.3, 1.0],
        [-0.3, 0.3],
        [-1.0, 0.3],
        [-1.0, -0.3],
        [-0.3, -0.3],
    ];
    case.block("angle").geometry = Geometry::Polygon {
        corners: plus,
        size: 0.35,
        element: ElementKind::Tri3,
    };
    case.block("triangle").translate = vec![-0.4, -0.4];
    assert!(check(&case, "a plus") > 0);
}

#[test]
fn blocks_that_ignore_each_other_pass() {
    let mut case = load("corner-hits");
    case.scene.contact.pair.push(cdem::scene::ContactPair {
        between: ["square".to_owned(), "triangle".to_owned()],
        friction_angle: None,
        cohesion: None,
        tensile_strength: None,
        normal_stiffness: None,
        shear_stiffness: None,
        enabled: Some(false),
    });
    let mut simulation = case.start();
    run(&mut simulation, |_| {});
    assert_eq!(simulation.contacts_begun(), 0);
    let velocity = simulation.block_rows()[0].velocity;
    assert!((velocity[0] - 10.0).abs() < 1e-10, "{velocity:?}");
}

#[test]
fn corners_that_slide_along_a_turning_edge_stay_on_it() {
    // Exactly, a point on an edge stays at gap 0. In the rest of the drift after first touch, a
    // point that slides by u while the edge rotates by a penetrates by u a: a third of the
    // tolerance here.
    let mut random = Random(11);
    let (mut met, mut worst) = (0, 0.0_f64);
    for _ in 0..40 {
        let mut case = load("corner-hits");
        (case.scene.time.end, case.scene.time.step) = (0.02, None);
        case.scene.contact.strength.friction_angle = 0.0;
        let triangle = case.block("triangle");
        triangle.velocity[1] = random.between(-40.0, 40.0);
        triangle.angular_velocity = vec![random.between(-10.0, 10.0)];
        let square = case.block("square");
        square.rotate.angle = 0.0;
        square.translate = vec![0.05, -0.5];
        square.angular_velocity = vec![random.between(-30.0, 30.0)];
        let mut simulation = case.start();
        run(&mut simulation, |_| ());
        met += u64::from(simulation.contacts_begun() > 0);
        let tolerance = simulation.scene().contact.tolerance.expect("filled in");
        worst = worst.max(simulation.max_penetration() / tolerance);
    }
    println!("{met} of 40 met, penetration {worst:.3} of the tolerance");
    assert!(met > 20);
    // The penetration that is left uncorrected is a tenth.
    assert!(worst < 0.2, "{worst} tolerances deep");
}
