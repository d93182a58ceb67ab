//! Cubes whose features meet in one line or plane, where which of them bear is a tie.

use cdem::mesh::ElementKind;
use cdem::scene::Rotation;
use cdem_verify::{Balance, Case, deepest_overlap, load, run};

/// How a cube of 1 m stands.
#[derive(Clone, Copy, Debug)]
enum Posture {
    Flat,
    /// Turned by an eighth about the vertical.
    Turned,
    /// On an edge along x, or along y.
    OnEdge(usize),
    OnCorner,
}

impl Posture {
    const ALL: [Self; 5] = [
        Self::Flat,
        Self::Turned,
        Self::OnEdge(0),
        Self::OnEdge(1),
        Self::OnCorner,
    ];

    fn rotation(self) -> Rotation {
        let eighth = std::f64::consts::FRAC_PI_4;
        let (axis, angle) = match self {
            Self::Flat => ([0.0, 0.0, 1.0], 0.0),
            Self::Turned => ([0.0, 0.0, 1.0], eighth),
            Self::OnEdge(0) => ([1.0, 0.0, 0.0], eighth),
            Self::OnEdge(_) => ([0.0, 1.0, 0.0], eighth),
            Self::OnCorner => {
                let side = std::f64::consts::FRAC_1_SQRT_2;
                ([side, -side, 0.0], f64::acos(1.0 / f64::sqrt(3.0)))
            }
        };
        Rotation { axis, angle }
    }

    /// Of its centre over its lowest point, m.
    fn height(self) -> f64 {
        match self {
            Self::Flat | Self::Turned => 0.5,
            Self::OnEdge(_) => f64::sqrt(0.5),
            Self::OnCorner => f64::sqrt(0.75),
        }
    }
}

/// A way to meet.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    /// How the cubes stand below and above.
    postures: [Posture; 2],
    /// What the upper one is aside by, m.
    aside: [f64; 2],
    speed: f64,
    spin: f64,
    friction: f64,
    whole: bool,
}

impl Meeting {
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for below in Posture::ALL {
            for above in Posture::ALL {
                for aside in [[0.0, 0.0], [0.25, 0.0], [0.5, 0.5], [0.0, 1e-5]] {
                    for bits in 0..16 {
                        let is_set = |bit: u32| bits & (1 << bit) != 0;
                        all.push(Self {
                            postures: [below, above],
                            aside,
                            speed: if is_set(0) { 7.0 } else { 1.0 },
                            spin: if is_set(1) { 2.0 } else { 0.0 },
                            friction: if is_set(2) { 30.0 } else { 0.0 },
                            whole: is_set(3),
                        });
                    }
                }
            }
        }
        all
    }

    fn case(&self) -> Case {
        let mut case = load("ties");
        case.scene.contact.strength.friction_angle = f64::to_radians(self.friction);
        let [below, above] = self.postures;
        let [x, y] = self.aside;
        let places = [[0.0, 0.0, -below.height()], [x, y, above.height() + 0.003]];
        for ((name, posture), place) in ["below", "above"].iter().zip(self.postures).zip(places) {
            if !self.whole {
                case.divide(name, &[2, 2, 2], ElementKind::Tet4);
            }
            let block = case.block(name);
            block.rotate = posture.rotation();
            block.translate = place.to_vec();
        }
        let above = case.block("above");
        above.velocity = vec![0.0, 0.0, -self.speed];
        above.angular_velocity = vec![0.0, 0.0, self.spin];
        case
    }

    /// Runs it; returns the deepest overlap over the tolerance.
    fn judge(&self) -> f64 {
        let mut simulation = self.case().start();
        let tolerance = simulation.scene().contact.tolerance.expect("filled in");
        let mut balance = Balance::new(&mut simulation);
        let mut deepest = 0.0_f64;
        run(&mut simulation, |simulation| {
            balance.look(simulation);
            if simulation.step_index().is_multiple_of(5) {
                deepest = deepest.max(deepest_overlap(&simulation.frame()));
            }
        });
        assert!(
            deepest < tolerance,
            "{self:?}: {deepest:e} of {tolerance:e}"
        );
        assert!(simulation.max_penetration() < tolerance, "{self:?}");
        assert_eq!(simulation.corrections().count, 0, "{self:?}");
        assert!(balance.momentum < 1e-12, "{self:?}: {balance:?}");
        // Blocks of one element (design, section 7).
        assert!(
            balance.growth < 2e-2 && balance.residual < 2e-2,
            "{self:?}: {balance:?}"
        );
        deepest / tolerance
    }
}

fn judge<'a>(meetings: impl Iterator<Item = &'a Meeting>) {
    let overlaps: Vec<f64> = meetings.map(Meeting::judge).collect();
    let deepest = overlaps.iter().copied().fold(0.0, f64::max);
    println!(
        "ties: {} meetings, at most {deepest:.2} of the tolerance",
        overlaps.len()
    );
}

/// Two that went wrong before: an edge that slides lengthwise off the end of another goes on
/// bearing with that end on the face beside; and where a corner goes past another, edges
/// that begin there and are all but parallel cross far from it.
#[test]
fn edges_all_but_parallel_do_not_sink_in() {
    let on_edge = Posture::OnEdge(0);
    let end = Meeting {
        postures: [on_edge, on_edge],
        aside: [0.0, 1e-5],
        speed: 7.0,
        spin: 2.0,
        friction: 0.0,
        whole: true,
    };
    let corner = Meeting {
        postures: [Posture::Flat, on_edge],
        aside: [0.5, 0.5],
        speed: 1.0,
        friction: 30.0,
        ..end
    };
    judge([end, corner].iter());
    judge(Meeting::all().iter().step_by(37));
}

#[test]
#[ignore = "slow study: sixteen hundred meetings"]
fn ties_of_all_kinds_do_not_sink_in() {
    judge(Meeting::all().iter());
}
