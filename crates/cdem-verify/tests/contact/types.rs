//! The three contact types in 2-D, each between two blocks.

use cdem::mesh::ElementKind;
use cdem::output::{ContactKind, ContactRow};
use cdem_verify::{Balance, Case, deepest_overlap, load, run};
use nalgebra::{DMatrix, DVector, Vector2};

const KINDS: [ContactKind; 3] = [
    ContactKind::VertexVertex,
    ContactKind::VertexEdge,
    ContactKind::EdgeEdge,
];

/// Time of first touch in all scenes, s.
const TOUCH: f64 = 5e-3;

fn scene(kind: ContactKind, divisions: usize) -> Case {
    let mut case = load(&format!("contact-types-2d/{}", kind.name()));
    for block in ["hammer", "anvil"] {
        case.divide(block, &[divisions; 2], ElementKind::Quad4);
    }
    case
}

/// Returns the contact points: nodes of either block on an edge of the other.
fn points(kind: ContactKind, divisions: usize) -> Vec<Vector2<f64>> {
    match kind {
        ContactKind::VertexVertex => vec![Vector2::zeros()],
        ContactKind::VertexEdge => vec![Vector2::new(0.1, 0.0)],
        _ => {
            let nodes = |low: f64, high: f64| {
                (0..=divisions).map(move |k| low + (high - low) * k as f64 / divisions as f64)
            };
            let of_hammer = nodes(-0.3, 0.5).filter(|&x| x < 0.1);
            let of_anvil = nodes(-1.3, 0.1).filter(|&x| x > -0.3);
            of_hammer
                .chain(of_anvil)
                .map(|x| Vector2::new(x, 0.0))
                .collect()
        }
    }
}

/// A block as a rigid body: mass, moment of inertia, centre and velocity at first touch, and spin.
#[derive(Clone, Copy)]
struct Rigid {
    mass: f64,
    inertia: f64,
    centre: Vector2<f64>,
    velocity: Vector2<f64>,
    spin: f64,
}

/// Returns hammer and anvil.
fn bodies(simulation: &mut cdem::Simulation) -> [Rigid; 2] {
    let rows = simulation.block_rows();
    // Width and height of the boxes of all scenes.
    [("hammer", [0.8, 0.6]), ("anvil", [1.4, 1.0])].map(|(name, [width, height])| {
        let row = rows.iter().find(|row| row.block == name).expect("named so");
        let velocity = Vector2::new(row.velocity[0], row.velocity[1]);
        Rigid {
            mass: row.mass,
            inertia: row.mass * (width * width + height * height) / 12.0,
            centre: Vector2::new(row.position[0], row.position[1]) + velocity * TOUCH,
            velocity,
            spin: row.angular_velocity[2],
        }
    })
}

/// Returns the sum of the normal impulses of two rigid bodies without restitution, N·s.
fn rigid(bodies: &[Rigid; 2], points: &[Vector2<f64>], normal: &Vector2<f64>) -> f64 {
    let count = points.len();
    let mut mobility = DMatrix::<f64>::zeros(count, count);
    let mut approach = DVector::<f64>::zeros(count);
    for (body, sign) in bodies.iter().zip([1.0, -1.0]) {
        let arms: Vec<f64> = points
            .iter()
            .map(|point| (point - body.centre).perp(normal))
            .collect();
        for i in 0..count {
            approach[i] += sign * body.velocity.dot(normal);
            for j in 0..count {
                mobility[(i, j)] += 1.0 / body.mass + arms[i] * arms[j] / body.inertia;
            }
        }
    }
    let inverse = mobility.pseudo_inverse(1e-12).expect("a positive bound");
    -(inverse * approach).sum()
}

/// Runs up to first touch. Returns all points that have touched, and the normal towards the hammer.
fn touch(case: &Case) -> (Vec<ContactRow>, Vector2<f64>) {
    let mut simulation = case.start();
    while simulation.contacts_begun() == 0 {
        simulation.step().expect("it is stable");
    }
    let normal = simulation.contact_frame().normals[0];
    let normal = Vector2::new(normal[0], normal[1]);
    let mut rows = simulation.live_contacts();
    rows.extend(simulation.ended_contacts());
    (rows, normal * normal.y.signum())
}

#[test]
fn the_type_of_a_contact_is_what_the_scene_makes() {
    for kind in KINDS {
        for divisions in [1, 3] {
            let mut swapped = scene(kind, divisions);
            swapped.scene.block.reverse();
            for case in [scene(kind, divisions), swapped] {
                let (rows, normal) = touch(&case);
                let expected = points(kind, divisions);
                println!(
                    "{}, {divisions} divisions: {} points, {normal:?}",
                    kind.name(),
                    rows.len()
                );
                assert_eq!(rows.len(), expected.len(), "{rows:?}");
                let tolerance = case.start().scene().contact.tolerance.expect("filled in");
                for row in rows {
                    assert_eq!(row.kind, kind, "{row:?}");
                    let place = Vector2::new(row.position[0], row.position[1]);
                    let nearest = expected.iter().map(|point| (point - place).norm());
                    assert!(
                        nearest.fold(f64::INFINITY, f64::min) < 0.1 * tolerance,
                        "{row:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn corners_whose_edges_go_on_in_one_line_are_one_contact() {
    for divisions in [1, 3] {
        for offset in [0.0, 1e-9, -1e-6] {
            let mut case = scene(ContactKind::VertexVertex, divisions);
            for block in ["hammer", "anvil"] {
                case.block(block).rotate.angle = std::f64::consts::FRAC_PI_4;
            }
            case.block("hammer").translate[0] = offset;
            let (rows, normal) = touch(&case);
            println!("{divisions} divisions, {offset:e} aside: {normal:?}, {rows:?}");
            assert_eq!(rows.len(), 1, "{rows:?}");
            assert_eq!(rows[0].kind, ContactKind::VertexVertex);
        }
    }
}

#[test]
fn a_bounce_is_that_of_rigid_bodies_with_the_restitution_of_its_energy() {
    for kind in KINDS {
        for divisions in [1, 3, 8] {
            let case = scene(kind, divisions);
            let (_, normal) = touch(&case);
            let mut simulation = case.start();
            let before = bodies(&mut simulation);
            let energy = simulation.history().kinetic_energy;
            let tolerance = simulation.scene().contact.tolerance.expect("filled in");
            let mut balance = Balance::new(&mut simulation);
            let (mut rows, mut overlap) = (Vec::new(), 0.0_f64);
            run(&mut simulation, |simulation| {
                balance.look(simulation);
                rows.extend(simulation.ended_contacts());
                overlap = overlap.max(deepest_overlap(&simulation.frame()));
            });
            assert_eq!(simulation.live_contacts(), []);
            let after = bodies(&mut simulation);
            let impulse: f64 = rows.iter().map(|row| row.normal_impulse).sum();
            let rigid = rigid(&before, &points(kind, divisions), &normal);
            let kept: f64 = after
                .iter()
                .map(|body| {
                    let spin = body.inertia * body.spin * body.spin;
                    0.5 * (body.mass * body.velocity.norm_squared() + spin)
                })
                .sum();
            let approach = -before[0].velocity.dot(&normal);
            let by_energy = (1.0 - (energy - kept) / (0.5 * approach * rigid)).sqrt();
            let change = before[0].mass * (after[0].velocity - before[0].velocity);
            let astray = (change - impulse * normal).norm() / impulse;
            let restitution = impulse / rigid - 1.0;
            println!(
                "{}, {divisions} divisions: {impulse:.4} N s, restitution {restitution:.4}, by \
                 energy {by_energy:.4}, astray {astray:.1e}, overlap {overlap:.1e}, residual {:.1e}",
                kind.name(),
                balance.residual
            );
            assert!(restitution > 0.0 && restitution < 1.0);
            // The blocks rotate during contact, which takes some ms.
            assert!(astray < 1e-3, "{astray}");
            if kind != ContactKind::EdgeEdge {
                assert!((restitution - by_energy).abs() < 2e-3);
            }
            assert!(overlap <= tolerance && simulation.max_penetration() <= tolerance);
            assert!(balance.momentum < 1e-12 && balance.angular_momentum < 1e-12);
            // Limit of the ledger for unrefined blocks of one element.
            assert!(
                balance.residual < 2e-2 && balance.growth < 1e-12,
                "{balance:?}"
            );
        }
    }
}
