//! The instant of the first touch. It is exact for all features, positions and models, whatever
//! the contact tolerance.

use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Rotation};
use cdem_verify::Random;
use nalgebra::{Rotation3, Unit, Vector3};

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

/// One drawn meeting.
#[derive(Debug)]
struct Draw {
    shapes: [ElementKind; 2],
    features: [Feature; 2],
    turns: [f64; 2],
    rotation: Rotation,
    shift: [f64; 3],
    /// Contact tolerance, m.
    tolerance: f64,
    model: ContactModel,
    /// Steps until the touch.
    steps: f64,
}

impl Draw {
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
            tolerance: 10.0_f64.powf(between(-6.0, -2.0)),
            steps: between(0.5, 4.5),
            features: PAIRS[random.whole(0, PAIRS.len() - 1)],
            shapes: [(); 2].map(|()| SHAPES[random.whole(0, SHAPES.len() - 1)]),
            model: [ContactModel::UnifiedNode, ContactModel::TwoScale][random.whole(0, 1)],
        }
    }

    /// Returns the time of the first touch in a run, in steps.
    fn touch(&self) -> f64 {
        let [hammer, anvil] = [0, 1].map(|k| {
            let place = (k == 0, self.turns[k], 1);
            Posed::new(self.shapes[k], self.features[k], place)
        });
        let mut case = case(0.0, STEP * (self.steps + 2.0).ceil());
        let axis = Unit::new_normalize(Vector3::from(self.rotation.axis));
        let turned = Rotation3::from_axis_angle(&axis, self.rotation.angle) * Vector3::z();
        let shift = Vector3::from(self.shift);
        let gap = self.steps * SPEED * STEP;
        for (name, place) in [("hammer", shift + turned * gap), ("anvil", shift)] {
            let block = case.block(name);
            block.rotate = self.rotation.clone();
            block.translate = place.as_slice().to_vec();
        }
        case.block("hammer").velocity = (turned * -SPEED).as_slice().to_vec();
        case.scene.material[0].young_modulus = MODULUS;
        case.scene.time.step = Some(STEP);
        case.scene.contact.tolerance = Some(self.tolerance);
        case.scene.contact.model = self.model;
        let mut simulation = start(&case, &hammer, &anvil);
        while simulation.contacts_begun() == 0 && !simulation.finished() {
            simulation.step().expect("it is stable");
        }
        let mut rows = simulation.live_contacts();
        rows.extend(simulation.ended_contacts());
        let times = rows.into_iter().map(|row| row.time_on);
        times.fold(f64::INFINITY, f64::min) / STEP
    }
}

/// Compares `count` drawn meetings with the exact instant.
fn compare(count: usize, seed: u64) {
    let mut random = Random(seed);
    for number in 0..count {
        let draw = Draw::new(&mut random);
        let touch = draw.touch();
        let error = (touch - draw.steps).abs();
        assert!(
            error <= ERROR,
            "{number}: {touch} is wrong by {error:e}: {draw:?}"
        );
    }
}

#[test]
fn the_first_touch_is_at_its_instant_for_any_tolerance() {
    compare(100, 1);
}

#[test]
#[ignore = "slow study: ten thousand meetings"]
fn the_first_touch_is_at_its_instant_ten_thousand_times() {
    compare(10_000, 2);
}
