//! Impacts of two blocks and their results: restitution, spin, contact time and cost.

use std::time::Instant;

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::output::{BlockRow, ContactRow};
use cdem::scene::{ContactModel, Geometry, Mass};
use cdem_verify::{Case, load};
use nalgebra::Vector3;

/// The contact model. The penalty stiffness of a contact point, N/m, is a multiple of E·h in 3-D,
/// and of E times the thickness in 2-D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Model {
    TwoScale,
    UnifiedNode,
    Penalty(f64),
}

/// A scene of two blocks that collide once.
pub(crate) struct Impact {
    pub(crate) scene: &'static str,
    /// The block that flies, and the block that it hits.
    pub(crate) blocks: [&'static str; 2],
    /// Velocity component of the approach.
    pub(crate) along: usize,
    pub(crate) element: ElementKind,
    /// Elements along each side of a block in the coarsest mesh.
    pub(crate) coarsest: &'static [usize],
    /// Factors of `coarsest` in the two finest meshes.
    pub(crate) fine: [usize; 2],
}

/// Results of an impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Figures {
    /// Speed of separation of the centres over the speed of approach. It is negative if one block
    /// topples the other and its centre moves on.
    pub(crate) restitution: f64,
    /// Angular velocity of the block that flew, rad/s.
    pub(crate) spin: Vector3<f64>,
    /// Contact time, s.
    pub(crate) duration: f64,
}

/// Results and cost of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    pub(crate) divisions: usize,
    pub(crate) figures: Figures,
    pub(crate) updates: f64,
    /// Shortest wall time of the step loop in several runs, s.
    pub(crate) seconds: f64,
    /// Impact loss and remesh loss, over the kinetic energy at the start.
    pub(crate) lost: [f64; 2],
}

impl Figures {
    /// Returns the errors of restitution, spin and duration, over the approach speed, the spin and
    /// the duration of the reference.
    pub(crate) fn errors(&self, reference: &Self) -> [f64; 3] {
        let spin = reference.spin.norm();
        // Bars have no spin but round-off.
        let turned = if spin > 1e-6 {
            (self.spin - reference.spin).norm() / spin
        } else {
            0.0
        };
        [
            (self.restitution - reference.restitution).abs(),
            turned,
            (self.duration / reference.duration - 1.0).abs(),
        ]
    }

    pub(crate) fn worst(&self, reference: &Self) -> f64 {
        self.errors(reference).into_iter().fold(0.0, f64::max)
    }
}

impl Impact {
    /// Builds the scene with a mesh, and a flight before the impact, s.
    fn case(&self, divisions: usize, model: Model, flight: f64) -> Case {
        let mut case = load(self.scene);
        for name in self.blocks {
            let into: Vec<usize> = self.coarsest.iter().map(|n| n * divisions).collect();
            case.divide(name, &into, self.element);
            let block = case.block(name);
            block.mass = Mass::Auto;
            let back = block.translate.iter_mut().zip(&block.velocity);
            back.for_each(|(x, speed)| *x -= speed * flight);
            if let [spin] = block.angular_velocity[..] {
                // Blocks that rotate have their centre at the origin of their shape.
                block.rotate.angle -= spin * flight;
            }
        }
        case.scene.time.end += flight;
        let stiffness = self.stiffness(&mut case, divisions);
        let contact = &mut case.scene.contact;
        contact.tolerance = None;
        contact.model = match model {
            Model::TwoScale => ContactModel::TwoScale,
            Model::UnifiedNode => ContactModel::UnifiedNode,
            Model::Penalty(times) => {
                contact.normal_stiffness = Some(times * stiffness);
                contact.shear_stiffness = Some(times * stiffness);
                // A spring beside an element of stiffness E h: ω² = 4 c²/h² (1 + 2 k / E h).
                case.scene.time.safety /= (1.0 + 2.0 * times).sqrt();
                ContactModel::Penalty
            }
        };
        case
    }

    /// Returns E·h in 3-D, with h along the first side of the block that is hit, and E times the
    /// thickness in 2-D, N/m.
    fn stiffness(&self, case: &mut Case, divisions: usize) -> f64 {
        let modulus = case.scene.material[0].young_modulus;
        if case.scene.dimension == 2 {
            return modulus * case.scene.thickness;
        }
        match &case.block(self.blocks[1]).geometry {
            Geometry::Box { min, max, .. } => {
                modulus * (max[0] - min[0]) / (self.coarsest[0] * divisions) as f64
            }
            other => panic!("{other:?} is no box"),
        }
    }

    /// Runs the impact `times` times. Returns `None` if a step fails, as it may with springs.
    pub(crate) fn run(
        &self,
        divisions: usize,
        model: Model,
        flight: f64,
        times: usize,
    ) -> Option<Outcome> {
        let case = self.case(divisions, model, flight);
        self.outcome(&case, divisions, times)
    }

    /// Runs the flight alone `times` times.
    pub(crate) fn fly(
        &self,
        divisions: usize,
        model: Model,
        flight: f64,
        times: usize,
    ) -> Option<Outcome> {
        let mut case = self.case(divisions, model, flight);
        case.scene.time.end = flight;
        self.outcome(&case, divisions, times)
    }

    fn outcome(&self, case: &Case, divisions: usize, times: usize) -> Option<Outcome> {
        let mut seconds = f64::INFINITY;
        let mut outcome = None;
        for _ in 0..times {
            let mut simulation = case.start();
            let start = simulation.block_rows();
            let energy = simulation.history().kinetic_energy;
            let begin = Instant::now();
            while !simulation.finished() {
                simulation.step().ok()?;
            }
            seconds = seconds.min(begin.elapsed().as_secs_f64());
            let end = simulation.history();
            outcome = Some(Outcome {
                divisions,
                figures: self.figures(&mut simulation, &start),
                updates: simulation.element_updates() as f64,
                seconds,
                lost: [end.impact_loss, end.remesh_loss].map(|loss| loss / energy),
            });
        }
        outcome
    }

    fn figures(&self, simulation: &mut Simulation, start: &[BlockRow]) -> Figures {
        let end = simulation.block_rows();
        let of = |rows: &[BlockRow], name: &str| {
            let row = rows.iter().find(|row| row.block == name);
            row.expect("the scene has the block").clone()
        };
        let approach = |rows: &[BlockRow]| {
            let [a, b] = self.blocks.map(|name| of(rows, name).velocity[self.along]);
            a - b
        };
        let mut contacts = simulation.ended_contacts();
        contacts.extend(simulation.live_contacts());
        Figures {
            restitution: -approach(&end) / approach(start),
            spin: of(&end, self.blocks[0]).angular_velocity.into(),
            duration: touched(contacts, simulation.time()),
        }
    }
}

/// Returns the total time in which at least one of the contacts exists, s. Contacts without an end
/// last until `end`.
fn touched(contacts: Vec<ContactRow>, end: f64) -> f64 {
    let spans = contacts
        .iter()
        .map(|row| [row.time_on, row.time_off.unwrap_or(end)]);
    let mut spans: Vec<[f64; 2]> = spans.collect();
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut sum, mut last) = (0.0, 0.0_f64);
    for [on, off] in spans {
        sum += (off - on.max(last)).max(0.0);
        last = last.max(off);
    }
    sum
}
