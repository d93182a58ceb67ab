//! The paper's case on two scales: two triangular prisms, each of one element.

use cdem::mesh::ElementKind;
use cdem::scene::{ContactModel, Mass, Rotation};
use cdem_verify::{Balance, Body, Case, load, mesh_of, run};

/// What a run of the two prisms comes to.
#[derive(Debug)]
struct Outcome {
    touch: f64,
    parted: f64,
    /// Speed of the struck block along the flight of the other, m/s.
    struck: f64,
    /// Most elements in the run, and those at its end.
    elements: [u64; 2],
    balance: Balance,
}

fn collide(mut simulation: cdem::Simulation, along: [f64; 3]) -> Outcome {
    let mut balance = Balance::new(&mut simulation);
    let mut most = 0;
    run(&mut simulation, |simulation| {
        most = most.max(balance.look(simulation).elements);
    });
    let end = simulation.history();
    let contacts = simulation.ended_contacts();
    assert_eq!(simulation.live_contacts(), []);
    let touch = contacts.iter().map(|c| c.time_on).fold(f64::MAX, f64::min);
    let parted = contacts.iter().filter_map(|c| c.time_off);
    let velocity = simulation.block_rows()[1].velocity;
    let struck = velocity.iter().zip(along).map(|(v, n)| v * n).sum();
    Outcome {
        touch,
        parted: parted.fold(0.0, f64::max),
        struck,
        elements: [most, end.elements],
        balance,
    }
}

fn two_scale(energy_loss: f64, angle: f64) -> Case {
    let mut case = load("two-prisms");
    case.scene.contact.model = ContactModel::TwoScale;
    case.scene.contact.energy_loss = energy_loss;
    case.scene.contact.tolerance = None;
    let (sin, cos) = angle.sin_cos();
    for block in &mut case.scene.block {
        block.mass = Mass::Auto;
        block.rotate = Rotation {
            axis: [0.0, 0.0, 1.0],
            angle,
        };
    }
    case.block("i").velocity[..2].copy_from_slice(&[3.0 * cos, 3.0 * sin]);
    case
}

impl Outcome {
    fn check(&self, elements: u64) {
        assert!((self.touch - 1.0 / 3.0).abs() < 1e-9, "{self:?}");
        // Until about 0.340 s (the paper's Fig. 16).
        assert!((0.338..0.342).contains(&self.parted), "{self:?}");
        let balance = &self.balance;
        assert!(balance.momentum < 1e-12, "{self:?}");
        assert!(balance.angular_momentum < 1e-12, "{self:?}");
        // Refined more than twice: design, section 7.
        assert!(balance.residual < 1e-3 && balance.rise < 1e-3, "{self:?}");
        assert_eq!(self.elements[1], elements, "{self:?}");
    }
}

/// In the plane, flying anywhere: the struck block leaves as the issue of refinement is
/// told to let it.
#[test]
fn triangles_bounce_at_every_angle() {
    for (energy_loss, wanted) in [(0.01, 2.94), (0.002, 2.97)] {
        for number in 0..5 {
            let angle = 1.3 * f64::from(number);
            let along = [angle.cos(), angle.sin(), 0.0];
            let outcome = collide(two_scale(energy_loss, angle).start(), along);
            println!("energy_loss {energy_loss}, angle {angle:.1}: {outcome:?}");
            outcome.check(2);
            assert!(outcome.struck > wanted, "{outcome:?}");
        }
    }
}

/// In space, as wedges of one metre.
#[test]
fn wedges_bounce() {
    let triangles = [
        [
            [-6.928_203_230_275_509, -4.0],
            [0.0, 0.0],
            [-6.928_203_230_275_509, 4.0],
        ],
        [[1.0, -4.0], [7.928_203_230_275_509, 0.0], [1.0, 4.0]],
    ];
    let wedge = |triangle: [[f64; 2]; 3]| {
        let at = |z: f64| triangle.map(|[x, y]| [x, y, z]);
        Body {
            kind: ElementKind::Wedge6,
            corners: at(0.0).into_iter().chain(at(1.0)).collect(),
            pieces: 1,
        }
    };
    let [i, j] = triangles.map(wedge);
    let bodies = [("block_i", i), ("block_j", j)];
    let mut case = two_scale(0.1, 0.0);
    case.scene.dimension = 3;
    case.scene.time.end = 0.36;
    for block in &mut case.scene.block {
        block.velocity.resize(3, 0.0);
        block.angular_velocity = vec![0.0; 3];
        block.translate = vec![0.0; 3];
    }
    case.scene.gravity = cdem::scene::Schedule::Constant(vec![0.0; 3]);
    let outcome = collide(case.start_from(|_| mesh_of(&bodies)), [1.0, 0.0, 0.0]);
    println!("wedges: {outcome:?}");
    outcome.check(2);
    assert!(outcome.struck > 2.9, "{outcome:?}");
}
