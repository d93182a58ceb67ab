//! Cubes whose features meet in one line or plane, so that the choice of contact points is a tie.

use cdem::mesh::ElementKind;
use cdem::scene::Rotation;
use cdem_verify::{Balance, Case, deepest_overlap, load, run};

/// Orientation of a cube of 1 m.
#[derive(Clone, Copy, Debug)]
enum Posture {
    Flat,
    /// Rotated by an eighth of a turn about the vertical.
    Turned,
    /// On an edge along x (0) or along y (1).
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

    /// Returns the height of the centre above the lowest point, m.
    fn height(self) -> f64 {
        match self {
            Self::Flat | Self::Turned => 0.5,
            Self::OnEdge(_) => f64::sqrt(0.5),
            Self::OnCorner => f64::sqrt(0.75),
        }
    }
}

/// An impact of two cubes.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    /// Orientation of the lower and the upper cube.
    postures: [Posture; 2],
    /// Horizontal offset of the upper cube, m.
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

    /// Runs the impact. Returns the deepest overlap over the tolerance, or the failed checks.
    fn judge(&self) -> Result<f64, String> {
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
        let mut faults = Vec::new();
        if deepest >= tolerance || simulation.max_penetration() >= tolerance {
            let penetration = simulation.max_penetration();
            faults.push(format!(
                "{deepest:e} and {penetration:e} m deep of {tolerance:e}"
            ));
        }
        if simulation.corrections().count > 0 {
            faults.push(format!("{:?}", simulation.corrections()));
        }
        // Limits for blocks of one element.
        if balance.momentum >= 1e-12 || balance.growth >= 2e-2 || balance.residual >= 2e-2 {
            faults.push(format!("{balance:?}"));
        }
        if faults.is_empty() {
            Ok(deepest / tolerance)
        } else {
            Err(format!("{self:?}: {}", faults.join(", ")))
        }
    }
}

fn judge(meetings: &[Meeting]) {
    let (mut deepest, mut faults) = (0.0_f64, Vec::new());
    for judged in meetings.iter().map(Meeting::judge) {
        match judged {
            Ok(overlap) => deepest = deepest.max(overlap),
            Err(fault) => faults.push(fault),
        }
    }
    let count = meetings.len();
    println!("ties: {count} meetings, at most {deepest:.2} of the tolerance");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Cases that failed earlier. (1) An edge slides lengthwise off the end of another, and is then
/// carried by that end on the adjacent face. (2) A corner passes another, and the almost parallel
/// edges that begin there cross far from it. (3) The contact point of such a crossing ends in the
/// kick before it. (4) Edges turn by 20 degrees a step against each other, and an impact elsewhere
/// changes how far they slide in the rest of the step.
#[test]
fn edges_all_but_parallel_do_not_sink_in() {
    let [on_edge, across] = [Posture::OnEdge(0), Posture::OnEdge(1)];
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
    let kinked = Meeting {
        postures: [across, across],
        whole: false,
        ..end
    };
    let crossing = Meeting {
        aside: [0.0, 0.0],
        ..kinked
    };
    let turning = Meeting {
        aside: [0.0, 1e-5],
        whole: true,
        ..kinked
    };
    let [turning_on_face, turning_under_face] =
        [[Posture::Flat, on_edge], [on_edge, Posture::Flat]].map(|postures| Meeting {
            postures,
            aside: [0.5, 0.5],
            ..kinked
        });
    judge(&[
        end,
        corner,
        kinked,
        crossing,
        turning,
        turning_on_face,
        turning_under_face,
    ]);
}

/// Every 13th impact: 13 divides no number of choices, so all choices of each kind occur.
#[test]
fn ties_of_all_kinds_do_not_sink_in() {
    let some: Vec<Meeting> = Meeting::all().into_iter().step_by(13).collect();
    judge(&some);
}

#[test]
#[ignore = "slow study: 1600 impacts"]
fn all_ties_do_not_sink_in() {
    judge(&Meeting::all());
}
