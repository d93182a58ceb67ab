//! A block pressed into a corner by nodes that touch it.

use cdem::mesh::ElementKind;
use cdem::scene::{BoundaryTarget, Geometry, Motion, Rotation, Schedule};
use cdem_verify::{Case, Random, load, run};
use nalgebra::{Rotation3, Unit, Vector3};

/// Confined modulus of the rock, Pa, and edge of the block, m.
const MODULUS: f64 = 12e9;
const SIZE: f64 = 0.5;

/// Presses one side of a block into a corner. Mesh, direction, small gap and place are random. Returns
/// the case and the travel of the side, m.
fn any_press(random: &mut Random) -> (Case, f64) {
    let mut case = load("pressed-into-corner");
    let divisions = [(); 3].map(|()| random.whole(1, 2));
    let element = [ElementKind::Tet4, ElementKind::Hex8][random.whole(0, 1)];
    case.divide("pressed", &divisions, element);
    let direction = Vector3::from([(); 3].map(|()| random.between(-1.0, 1.0))).normalize();
    let turn = Rotation {
        axis: direction.into(),
        angle: random.between(0.0, std::f64::consts::TAU),
    };
    let rotation = Rotation3::from_axis_angle(&Unit::new_normalize(direction), turn.angle);
    let far = 10.0_f64.powf(random.between(-1.0, 3.0));
    let shift = Vector3::from([(); 3].map(|()| far * random.between(-1.0, 1.0)));
    for name in ["floor", "wall", "pressed"] {
        let block = case.block(name);
        (block.rotate, block.translate) = (turn.clone(), shift.as_slice().to_vec());
    }
    if let Geometry::Box { min, max, .. } = &mut case.block("pressed").geometry {
        let gap = 10.0_f64.powf(random.between(-9.0, -5.0));
        (*min, *max) = (vec![gap, 0.0, gap], vec![gap + SIZE, SIZE, gap + SIZE]);
    }
    let velocity = Vector3::new(-random.between(0.0, 1.0), 0.0, -random.between(0.0, 1.0)) * 1e-4;
    let side = ["xmin", "xmax", "zmin", "zmax"][random.whole(0, 3)];
    let boundary = &mut case.scene.boundary[0];
    boundary.target = BoundaryTarget::Group(format!("pressed.{side}"));
    let components = rotation * velocity;
    boundary.motion = Motion::Velocity([0, 1, 2].map(|c| Some(Schedule::Constant(components[c]))));
    case.scene.contact.tolerance = Some(SIZE * 10.0_f64.powf(random.between(-6.0, -2.0)));
    case.scene.contact.strength.friction_angle = random.between(0.0, 0.8);
    case.scene.time.end = 0.03;
    let travel = velocity.norm() * case.scene.time.end;
    (case, travel)
}

/// Runs a case. Asserts that the work on the block is that of a slow compression: in two directions and
/// in shear at most twice M ε² V. Returns true if contacts have begun.
fn is_compressed_slowly(case: &Case, travel: f64) -> bool {
    let mut simulation = case.start();
    let mut most = 0.0_f64;
    run(&mut simulation, |simulation| {
        most = most.max(simulation.history().external_work.abs());
    });
    let limit = 2.0 * MODULUS * (travel / SIZE).powi(2) * SIZE.powi(3);
    assert!(most <= limit, "{most:e} J of {limit:e} J, {:?}", case.scene);
    simulation.contacts_begun() > 0
}

/// Nothing can stop the prescribed nodes. The others must not be thrown about.
#[test]
fn a_block_pressed_into_a_corner_is_compressed_slowly() {
    let case = load("pressed-into-corner");
    assert!(is_compressed_slowly(&case, 4e-6 * 2.0_f64.sqrt()));
    let mut random = Random(23);
    let mut touching = 0;
    for _ in 0..30 {
        let (case, travel) = any_press(&mut random);
        touching += usize::from(is_compressed_slowly(&case, travel));
    }
    assert!(touching >= 15, "{touching}");
}
