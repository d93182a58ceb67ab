//! The same state takes the same path wherever it is, seen in a mirror, and with other numbers: ties
//! are not broken by the last digits of coordinates.

use cdem_verify::{Case, Random, load, run};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// Path of the cube.
struct Path {
    /// Number of elements after each step.
    elements: Vec<u64>,
    /// Its angular velocity after each step, rad/s.
    spin: Vec<Vector3<f64>>,
}

fn fall(case: &Case) -> Path {
    let mut simulation = case.start();
    let mut path = Path {
        elements: Vec::new(),
        spin: Vec::new(),
    };
    run(&mut simulation, |simulation| {
        path.elements.push(simulation.history().elements);
        let rows = simulation.block_rows();
        let cube = rows.iter().find(|row| row.block == "cube").expect("a cube");
        path.spin.push(cube.angular_velocity.into());
    });
    path
}

/// Checks that a variant of the case cuts the same elements and has the same spin, times `sign`.
fn check(path: &Path, name: &str, variant: &Case, sign: [f64; 3]) {
    let (elements, apart) = compare(path, name, variant, sign);
    assert!(elements && apart < 1e-9, "{name}: {apart:e}");
}

/// Compares a variant of the case with the path. Returns true if it cuts the same elements, and the
/// largest difference of its spin, times `sign`, over the largest spin.
fn compare(path: &Path, name: &str, variant: &Case, sign: [f64; 3]) -> (bool, f64) {
    let (other, sign) = (fall(variant), Vector3::from(sign));
    let spins = path.spin.iter().zip(&other.spin);
    let apart = spins.map(|(a, b)| (a - b.component_mul(&sign)).amax());
    let apart = apart.fold(0.0, f64::max);
    let fastest = path.spin.iter().map(Vector3::amax).fold(0.0, f64::max);
    println!("{name}: spin off by {:.1e}", apart / fastest);
    (path.elements == other.elements, apart / fastest)
}

fn moved([x, y]: [f64; 2]) -> Case {
    let mut case = load("same-path");
    let place = &mut case.block("cube").translate;
    place[0] += x;
    place[1] += y;
    case
}

/// Mirrors the case in the plane x = 0. The plane of the case reaches from -2 to 3 m.
fn mirrored(mut case: Case) -> Case {
    case.block("plane").translate[0] -= 1.0;
    let cube = case.block("cube");
    cube.translate[0] *= -1.0;
    for across in &mut cube.rotate.axis[1..] {
        *across *= -1.0;
    }
    case
}

/// Numbers the nodes of the cube otherwise: turns it on to itself before it is rotated.
fn renumbered(mut case: Case, axis: [f64; 3], degrees: f64) -> Case {
    let rotate = &mut case.block("cube").rotate;
    let about = |axis: [f64; 3], angle| {
        UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis.into()), angle)
    };
    let whole = about(rotate.axis, rotate.angle) * about(axis, f64::to_radians(degrees));
    let (axis, angle) = whole.axis_angle().expect("a rotation");
    (rotate.axis, rotate.angle) = (axis.into_inner().into(), angle);
    case
}

/// Elements and kinetic energy after each step.
fn fall_of_three(case: &Case) -> Vec<(u64, f64)> {
    let mut rows = Vec::new();
    run(&mut case.start(), |simulation| {
        let row = simulation.history();
        rows.push((row.elements, row.kinetic_energy));
    });
    rows
}

/// When corners with zones that overlap took the order of their blocks, the second fall was refined
/// to 87 or to 113 elements.
#[test]
fn blocks_meet_alike_in_any_order() {
    let case = load("blocks-in-any-order");
    let straight = fall_of_three(&case);
    for order in [[2, 1, 0], [1, 0, 2], [1, 2, 0]] {
        let mut other = case.clone();
        other.scene.block = order.map(|k| case.scene.block[k].clone()).to_vec();
        check_fall(&straight, &other, 1e-9, &format!("{order:?}"));
    }
}

/// When the size of a block was that of a box along the axes, it grew as the block was turned, and
/// fast blocks were refined less.
#[test]
fn blocks_meet_alike_in_any_direction() {
    // Measured in six directions: 6e-14 and 3e-9. Fast, some solves end before they are exact, and
    // amplify round-off.
    for (speed, round_off) in [(1.0, 1e-9), (6.0, 1e-7)] {
        let mut case = load("blocks-in-any-order");
        for block in &mut case.scene.block {
            block.velocity = block.velocity.iter().map(|v| speed * v).collect();
        }
        let straight = fall_of_three(&case);
        for degrees in [33.0, 45.0] {
            let name = format!("{speed} times as fast, by {degrees} degrees");
            check_fall(&straight, &turned(&case, degrees), round_off, &name);
        }
    }
}

/// Compares the numbers of elements, and the energies up to the growth of `round_off`, relative.
fn check_fall(straight: &[(u64, f64)], case: &Case, round_off: f64, name: &str) {
    let other = fall_of_three(case);
    assert_eq!(straight.len(), other.len(), "{name}");
    for (step, (one, other)) in straight.iter().zip(&other).enumerate() {
        assert_eq!(one.0, other.0, "{name}, step {step}");
        let apart = (one.1 / other.1 - 1.0).abs();
        assert!(apart < round_off, "{name}, step {step}: {apart:e}");
    }
}

/// Turns a plane scene about the origin.
fn turned(case: &Case, degrees: f64) -> Case {
    let mut case = case.clone();
    let (sine, cosine) = degrees.to_radians().sin_cos();
    for block in &mut case.scene.block {
        block.rotate.angle += degrees.to_radians();
        for vector in [&mut block.translate, &mut block.velocity] {
            let [x, y] = [vector[0], vector[1]];
            *vector = vec![cosine * x - sine * y, sine * x + cosine * y];
        }
    }
    case
}

#[test]
fn a_cube_falls_alike_here_and_there_mirrored_and_renumbered() {
    let path = fall(&moved([0.0; 2]));
    let most = path.elements.iter().max();
    assert!(most > path.elements.first(), "{most:?}");
    for shift in [[0.0, 1e-14], [0.0, 1e-3], [0.1, 1.0]] {
        check(
            &path,
            &format!("moved by {shift:?} m"),
            &moved(shift),
            [1.0; 3],
        );
    }
    check(
        &path,
        "mirrored",
        &mirrored(load("same-path")),
        [1.0, -1.0, -1.0],
    );
    for (axis, degrees) in [
        ([0.0, 0.0, 1.0], 90.0),
        ([1.0, 0.0, 0.0], 180.0),
        ([1.0, 1.0, 1.0], 120.0),
    ] {
        let name = format!("turned about {axis:?} by {degrees}°");
        check(
            &path,
            &name,
            &renumbered(load("same-path"), axis, degrees),
            [1.0; 3],
        );
    }
    let mut case = moved([0.0; 2]);
    case.scene.block.reverse();
    check(&path, "the plane first", &case, [1.0; 3]);
}

/// Changes a case in one of the ways that must not matter. Returns its name and the signs of the
/// spin too.
fn altered(mut case: Case, random: &mut Random) -> (String, Case, [f64; 3]) {
    match random.whole(0, 3) {
        0 => {
            let exponent = random.between(-14.0, 0.0);
            for place in &mut case.block("cube").translate[..2] {
                *place += random.between(-1.0, 1.0) * 10.0_f64.powf(exponent);
            }
            (format!("moved by up to 1e{exponent:.1} m"), case, [1.0; 3])
        }
        1 => ("mirrored".into(), mirrored(case), [1.0, -1.0, -1.0]),
        2 => {
            let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            for _ in 0..3 {
                let turn = 90.0 * random.whole(0, 3) as f64;
                case = renumbered(case, axes[random.whole(0, 2)], turn);
            }
            ("renumbered".into(), case, [1.0; 3])
        }
        _ => {
            case.scene.block.reverse();
            ("the plane first".into(), case, [1.0; 3])
        }
    }
}

#[test]
#[ignore = "slow study: five hundred falls, each with one that must be alike"]
fn any_fall_is_alike_here_and_there_mirrored_and_renumbered() {
    let mut random = Random(7);
    let mut alike = 0;
    for number in 0..500 {
        let drop = || {
            let mut drawn = Random(1000 + number);
            let mut case = load("same-path");
            let rotate = &mut case.block("cube").rotate;
            let axis = Vector3::from([(); 3].map(|()| drawn.between(-1.0, 1.0)));
            rotate.axis = axis.normalize().into();
            rotate.angle = drawn.between(0.0, std::f64::consts::TAU);
            case
        };
        let path = fall(&drop());
        let (name, variant, sign) = altered(drop(), &mut random);
        let (elements, apart) = compare(&path, &format!("fall {number}, {name}"), &variant, sign);
        alike += usize::from(elements && apart < 1e-9);
    }
    println!("{alike} of 500 alike");
    // Solves end at a residual. In some falls round-off decides on their last sweep.
    assert!(alike > 490);
}
