//! The instant of the first touch. It is exact for all features, positions and models, whatever
//! the contact tolerance.

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Geometry, Rotation};
use cdem_verify::{Case, Random, load};
use nalgebra::{Rotation2, Rotation3, Unit, Vector2, Vector3};

use crate::meeting::{Feature, PAIRS, Posed, SHAPES, case, start};

/// Step, s, and speed of the hammer, m/s. In a step the hammer moves by a third of its size.
const STEP: f64 = 0.5;
const SPEED: f64 = 0.4;

/// Young's modulus, Pa: so small that a step of this length is stable.
const MODULUS: f64 = 1e-3;

/// Largest error of a touch, in steps. Coordinates of up to 4 m have a round-off of 4e-16 m. It
/// counts over the motion in a step, 0.2 m, and the cosine of the motion with the normal of the
/// features: 2e-15 of a step, and more the flatter they meet.
const ERROR: f64 = 1e-12;

/// The part of a meeting that is the same in the plane and in space.
#[derive(Debug)]
struct Setting {
    /// Contact tolerance, m.
    tolerance: f64,
    model: ContactModel,
    /// Steps until the touch.
    steps: f64,
}

impl Setting {
    fn new(random: &mut Random) -> Self {
        Self {
            tolerance: 10.0_f64.powf(random.between(-6.0, -2.0)),
            model: [ContactModel::UnifiedNode, ContactModel::TwoScale][random.whole(0, 1)],
            steps: random.between(0.5, 4.5),
        }
    }

    /// Returns the gap at the start, m.
    fn gap(&self) -> f64 {
        self.steps * SPEED * STEP
    }

    /// Sets this part in a case.
    fn apply(&self, case: &mut Case) {
        case.scene.material[0].young_modulus = MODULUS;
        case.scene.time.end = STEP * (self.steps + 2.0).ceil();
        case.scene.time.step = Some(STEP);
        case.scene.contact.tolerance = Some(self.tolerance);
        case.scene.contact.model = self.model;
    }
}

/// Returns the time of the first touch in a run, in steps.
fn first_touch(mut simulation: Simulation) -> f64 {
    while simulation.contacts_begun() == 0 && !simulation.finished() {
        simulation.step().expect("it is stable");
    }
    let mut rows = simulation.live_contacts();
    rows.extend(simulation.ended_contacts());
    let times = rows.into_iter().map(|row| row.time_on);
    times.fold(f64::INFINITY, f64::min) / STEP
}

/// A drawn meeting in space.
#[derive(Debug)]
struct SolidMeeting {
    shapes: [ElementKind; 2],
    features: [Feature; 2],
    turns: [f64; 2],
    rotation: Rotation,
    shift: [f64; 3],
    setting: Setting,
}

impl SolidMeeting {
    fn new(random: &mut Random) -> Self {
        let mut between = |low: f64, high: f64| random.between(low, high);
        let axis = Vector3::from([(); 3].map(|()| between(-1.0, 1.0)));
        Self {
            rotation: Rotation {
                axis: axis.normalize().into(),
                angle: between(0.0, std::f64::consts::TAU),
            },
            turns: [(); 2].map(|()| between(0.0, 1.5)),
            shift: [(); 3].map(|()| between(-1.0, 1.0)),
            features: PAIRS[random.whole(0, PAIRS.len() - 1)],
            shapes: [(); 2].map(|()| SHAPES[random.whole(0, SHAPES.len() - 1)]),
            setting: Setting::new(random),
        }
    }

    fn start(&self) -> Simulation {
        let [hammer, anvil] = [0, 1].map(|k| {
            let place = (k == 0, self.turns[k], 1);
            Posed::new(self.shapes[k], self.features[k], place)
        });
        let mut case = case(0.0, 0.0);
        let axis = Unit::new_normalize(Vector3::from(self.rotation.axis));
        let up = Rotation3::from_axis_angle(&axis, self.rotation.angle) * Vector3::z();
        let shift = Vector3::from(self.shift);
        for (name, gap) in [("hammer", self.setting.gap()), ("anvil", 0.0)] {
            let block = case.block(name);
            block.rotate = self.rotation.clone();
            block.translate = (shift + up * gap).as_slice().to_vec();
        }
        case.block("hammer").velocity = (up * -SPEED).as_slice().to_vec();
        self.setting.apply(&mut case);
        start(&case, &hammer, &anvil)
    }
}

/// A drawn meeting of two polygons in the plane.
#[derive(Debug)]
struct PlaneMeeting {
    polygons: [Vec<[f64; 2]>; 2],
    /// The hammer and the anvil meet with a side, not with a corner.
    are_sides: [bool; 2],
    angle: f64,
    shift: [f64; 2],
    setting: Setting,
}

impl PlaneMeeting {
    fn new(random: &mut Random) -> Self {
        Self {
            polygons: [(); 2].map(|()| {
                let count = random.whole(3, 7);
                random.polygon([0.0; 2], 0.5, count)
            }),
            are_sides: [(); 2].map(|()| random.whole(0, 1) == 1),
            angle: random.between(0.0, std::f64::consts::TAU),
            shift: [(); 2].map(|()| random.between(-1.0, 1.0)),
            setting: Setting::new(random),
        }
    }

    fn start(&self) -> Simulation {
        let turned = Rotation2::new(self.angle);
        let up = turned * Vector2::y();
        let mut case = load("contact-types-2d/vertex-edge");
        for (k, name) in ["hammer", "anvil"].into_iter().enumerate() {
            let (outward, gap) = [(-up, self.setting.gap()), (up, 0.0)][k];
            let place = Vector2::from(self.shift) + up * gap;
            let block = case.block(name);
            block.geometry = Geometry::Polygon {
                corners: posed(&self.polygons[k], self.are_sides[k], outward),
                size: 1.0,
                element: ElementKind::Tri3,
            };
            block.rotate.angle = 0.0;
            block.translate = place.as_slice().to_vec();
        }
        case.block("hammer").velocity = (up * -SPEED).as_slice().to_vec();
        self.setting.apply(&mut case);
        case.start()
    }
}

/// Returns the corners of a polygon that touches the origin with its first corner, or with a point
/// of its first side, and lies behind it as seen along `outward`.
fn posed(polygon: &[[f64; 2]], is_side: bool, outward: Vector2<f64>) -> Vec<[f64; 2]> {
    let corner = |k: usize| Vector2::from(polygon[k % polygon.len()]);
    let along = |k: usize| (corner(k + 1) - corner(k)).normalize();
    let right = |side: Vector2<f64>| Vector2::new(side.y, -side.x);
    let (point, own) = if is_side {
        (corner(0).lerp(&corner(1), 0.45), right(along(0)))
    } else {
        // Not symmetric: the sides of the corner are not equally steep.
        let before = along(polygon.len() - 1);
        (corner(0), 0.6 * right(before) + 0.4 * right(along(0)))
    };
    let turn = Rotation2::rotation_between(&own, &outward);
    let place = |k: usize| (turn * (corner(k) - point)).into();
    (0..polygon.len()).map(place).collect()
}

/// Compares `count` drawn meetings with the exact instant, half of them in the plane.
fn compare(count: usize, seed: u64) {
    let mut random = Random(seed);
    for number in 0..count / 2 {
        let plane = PlaneMeeting::new(&mut random);
        let (steps, touch) = (plane.setting.steps, first_touch(plane.start()));
        judge(number, [touch, steps], &plane);
        let solid = SolidMeeting::new(&mut random);
        let (steps, touch) = (solid.setting.steps, first_touch(solid.start()));
        judge(number, [touch, steps], &solid);
    }
}

fn judge(number: usize, [touch, exact]: [f64; 2], meeting: &impl std::fmt::Debug) {
    let error = (touch - exact).abs();
    assert!(
        error <= ERROR,
        "{number}: {touch} is wrong by {error:e}: {meeting:?}"
    );
}

#[test]
fn the_first_touch_is_at_its_instant_for_any_tolerance() {
    compare(200, 1);
}

#[test]
#[ignore = "slow study: twenty thousand meetings"]
fn the_first_touch_is_at_its_instant_twenty_thousand_times() {
    compare(20_000, 2);
}
