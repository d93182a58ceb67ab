//! The six contact types, each between two elements.

use cdem::Simulation;
use cdem::output::{ContactKind, ContactRow};
use cdem_verify::{Balance, Case, deepest_overlap, load, run};
use nalgebra::{DMatrix, DVector, Rotation3, Unit, Vector3};

use crate::element::Element;

pub(crate) const KINDS: [ContactKind; 6] = [
    ContactKind::VertexVertex,
    ContactKind::VertexEdge,
    ContactKind::VertexFace,
    ContactKind::EdgeEdge,
    ContactKind::EdgeFace,
    ContactKind::FaceFace,
];

/// Time of first touch in all scenes, s.
pub(crate) const TOUCH: f64 = 5e-3;

pub(crate) fn scene(kind: ContactKind) -> Case {
    load(&format!("contact-types-3d/{}", kind.name()))
}

/// Returns the contact points of a scene and the normal, from anvil to hammer.
pub(crate) fn meeting(kind: ContactKind) -> (Vec<Vector3<f64>>, Vector3<f64>) {
    let points: &[[f64; 3]] = match kind {
        ContactKind::VertexVertex => &[[0.0, 0.0, 0.0]],
        ContactKind::VertexEdge => &[[0.15, 0.0, 0.0]],
        ContactKind::VertexFace => &[[0.1, -0.15, 0.0]],
        ContactKind::EdgeEdge => &[[0.1 - 0.05 / 70.0_f64.to_radians().tan(), 0.0, 0.0]],
        ContactKind::EdgeFace => &[[-0.45, 0.1, 0.0], [0.55, 0.1, 0.0]],
        ContactKind::FaceFace => &[
            [-0.15, 0.0, 0.0],
            [0.4, 0.55 * 0.35 / 0.6, 0.0],
            [0.4, -0.55 * 0.3 / 0.6, 0.0],
        ],
    };
    let turned = |axis: [f64; 3], normal: Vector3<f64>| {
        let axis = Unit::new_normalize(Vector3::from(axis));
        Rotation3::from_axis_angle(&axis, 50.0_f64.to_radians()) * normal
    };
    let normal = match kind {
        // The normal of the steepest face at the corner, or of the face at the edge.
        ContactKind::VertexVertex => turned([1.0, -0.8, 0.1], Vector3::x()),
        ContactKind::VertexEdge => turned([1.0, 0.0, 0.0], Vector3::z()),
        _ => Vector3::z(),
    };
    (points.iter().map(|&point| point.into()).collect(), normal)
}

/// Returns hammer and anvil at first touch, found by name in any order.
pub(crate) fn elements(simulation: &mut Simulation) -> [Element; 2] {
    let elements = Element::all(simulation);
    ["hammer", "anvil"].map(|name| {
        let named = elements.iter().find(|element| element.block == name);
        let mut element = named.expect("the scene has the block").clone();
        for node in &mut element.nodes {
            *node += element.velocity * TOUCH;
        }
        element
    })
}

/// Returns the impulses at `points`, N·s, along each of `directions`, that leave no relative
/// velocity there, as unified nodes do.
fn unify(
    bodies: &[Element; 2],
    points: &[Vector3<f64>],
    directions: &[Vector3<f64>],
) -> DMatrix<f64> {
    let count = points.len() * directions.len();
    let mut mobility = DMatrix::<f64>::zeros(count, count);
    let mut approach = DVector::<f64>::zeros(count);
    for (body, sign) in bodies.iter().zip([1.0, -1.0]) {
        let weights: Vec<_> = points.iter().map(|point| body.weights(point)).collect();
        let inverse = body.mass_matrix().try_inverse().expect("it has mass");
        for i in 0..count {
            let [p, d] = [i / directions.len(), i % directions.len()];
            approach[i] += sign * body.velocity.dot(&directions[d]);
            for j in 0..count {
                let [q, e] = [j / directions.len(), j % directions.len()];
                let seen = weights[p].dot(&(&inverse * &weights[q]));
                mobility[(i, j)] += seen * directions[d].dot(&directions[e]);
            }
        }
    }
    let inverse = mobility.pseudo_inverse(1e-12).expect("a positive bound");
    let impulses: DVector<f64> = -(inverse * approach);
    DMatrix::from_row_slice(points.len(), directions.len(), impulses.as_slice())
}

/// Returns the sum of the normal impulses of two rigid bodies without restitution, N·s.
pub(crate) fn rigid(bodies: &[Element; 2], points: &[Vector3<f64>], normal: &Vector3<f64>) -> f64 {
    let count = points.len();
    let (mut mobility, mut approach) = (
        DMatrix::<f64>::zeros(count, count),
        DVector::<f64>::zeros(count),
    );
    for (body, sign) in bodies.iter().zip([1.0, -1.0]) {
        let turning = body.inertia().try_inverse().expect("it has inertia");
        let arms: Vec<_> = points
            .iter()
            .map(|point| (point - body.centre()).cross(normal))
            .collect();
        for i in 0..count {
            approach[i] += sign * body.velocity.dot(normal);
            for j in 0..count {
                mobility[(i, j)] += 1.0 / body.mass + arms[i].dot(&(turning * arms[j]));
            }
        }
    }
    let inverse = mobility.pseudo_inverse(1e-12).expect("a positive bound");
    -(inverse * approach).sum()
}

#[test]
fn the_first_touch_is_that_of_unified_nodes() {
    for kind in KINDS {
        // First touch at the end of a step, where round-off once decided between faces; in the
        // middle of a step; and with sideways motion that almost sticks.
        for (step, friction) in [(1e-3, 0.0), (0.7e-3, 0.0), (0.7e-3, 85.0)] {
            let mut case = scene(kind);
            // So soft that within a step an element acts by its mass alone.
            case.scene.material[0].young_modulus *= 1e-12;
            case.scene.time.step = Some(step);
            case.scene.contact.strength.friction_angle = f64::to_radians(friction);
            if friction > 0.0 {
                let sideways = [0.05, -0.03];
                let hammer = case.block("hammer");
                for (c, speed) in sideways.into_iter().enumerate() {
                    hammer.velocity[c] = speed;
                    hammer.translate[c] -= speed * TOUCH;
                }
            }
            let mut simulation = case.start();
            let bodies = elements(&mut simulation);
            while simulation.contacts_begun() == 0 {
                simulation.step().expect("it is stable");
            }
            let mut rows = simulation.live_contacts();
            rows.extend(simulation.ended_contacts());
            let sum = |of: fn(&ContactRow) -> f64| rows.iter().map(of).sum::<f64>();
            let found = [sum(|row| row.normal_impulse), sum(|row| row.shear_impulse)];
            let (points, normal) = meeting(kind);
            let along = normal.cross(&Vector3::new(0.3, 0.5, 0.7)).normalize();
            let frame = [normal, along, normal.cross(&along)];
            let directions = if friction > 0.0 {
                &frame[..]
            } else {
                &frame[..1]
            };
            let impulses = unify(&bodies, &points, directions);
            let mut exact = [0.0; 2];
            for row in impulses.row_iter() {
                let shear = row.columns_range(1..).norm();
                assert!(shear <= row[0] * f64::to_radians(friction).tan());
                exact[0] += row[0];
                exact[1] += shear;
            }
            println!(
                "{}, step {step}, friction {friction}: {found:.9?} N s, exact {exact:.9?}",
                kind.name()
            );
            assert_eq!(rows.len(), points.len(), "{rows:?}");
            assert!(rows.iter().all(|row| row.kind == kind), "{rows:?}");
            for (found, exact) in found.iter().zip(exact) {
                // The residual of the solver; positions are exact to 1e-12 of the block size.
                assert!(
                    (found - exact).abs() < 1e-10 * impulses[0],
                    "{found} {exact}"
                );
            }
        }
    }
}

#[test]
fn contacts_are_drawn_where_they_are() {
    for kind in KINDS {
        let mut simulation = scene(kind).start();
        let speeds = elements(&mut simulation).map(|body| body.velocity.norm());
        let step = simulation.overview().step;
        while simulation.contacts_begun() == 0 {
            simulation.step().expect("it is stable");
        }
        let rows = simulation.live_contacts();
        let points = simulation.contact_frame().points;
        assert_eq!(points.len(), rows.len(), "{rows:?}");
        for (point, row) in points.iter().zip(&rows) {
            // At most the rest of the step, at the speed of the faster body.
            let apart = (Vector3::from(*point) - Vector3::from(row.position)).norm();
            assert!(
                apart <= step * speeds[0].max(speeds[1]),
                "{kind:?}: {apart}"
            );
        }
    }
}

/// Results of a bounce.
struct Bounce {
    rows: Vec<ContactRow>,
    /// Velocities, m/s, and spins, rad/s, of hammer and anvil.
    velocity: [Vector3<f64>; 2],
    spin: [Vector3<f64>; 2],
}

/// Runs a scene to its end and checks what holds in any bounce.
fn bounce(case: &Case) -> Bounce {
    let mut simulation = case.start();
    let mut balance = Balance::new(&mut simulation);
    let (mut overlap, mut rows) = (0.0_f64, Vec::new());
    run(&mut simulation, |simulation| {
        balance.look(simulation);
        overlap = overlap.max(deepest_overlap(&simulation.frame()));
        rows.extend(simulation.ended_contacts());
    });
    assert_eq!(simulation.live_contacts(), []);
    let tolerance = simulation.scene().contact.tolerance.expect("filled in");
    let penetration = simulation.max_penetration();
    println!(
        "  penetration {penetration:.1e}, overlap {overlap:.1e} m, momentum {:.1e}, angular {:.1e}, \
         residual {:.1e}, growth {:.1e}",
        balance.momentum, balance.angular_momentum, balance.residual, balance.growth
    );
    assert!(penetration <= tolerance, "{penetration}");
    assert!(overlap <= tolerance, "{overlap}");
    assert!(balance.momentum < 1e-12, "{balance:?}");
    assert!(balance.angular_momentum < 1e-12, "{balance:?}");
    // Limit of the ledger for unrefined blocks of one element.
    assert!(balance.residual < 2e-2, "{balance:?}");
    assert!(balance.growth < 1e-12, "{balance:?}");
    let blocks = simulation.block_rows();
    let of = |name: &str| {
        blocks
            .iter()
            .find(|row| row.block == name)
            .expect("named so")
    };
    let pair = [of("hammer"), of("anvil")];
    sort_rows(&mut rows, &Rotation3::identity());
    Bounce {
        rows,
        velocity: pair.map(|row| row.velocity.into()),
        spin: pair.map(|row| row.angular_velocity.into()),
    }
}

#[test]
fn a_bounce_is_that_of_rigid_bodies_with_some_restitution() {
    for kind in KINDS {
        let case = scene(kind);
        let bodies = elements(&mut case.start());
        let Bounce {
            rows,
            velocity,
            spin,
        } = bounce(&case);
        let (points, normal) = meeting(kind);
        let impulse: f64 = rows.iter().map(|row| row.normal_impulse).sum();
        let rigid = rigid(&bodies, &points, &normal);
        println!(
            "{}: {} contacts, impulse {impulse:.4} N s, {:.4} of that of no restitution",
            kind.name(),
            rows.len(),
            impulse / rigid
        );
        assert!(
            impulse > rigid && impulse < 2.0 * rigid,
            "{impulse} {rigid}"
        );
        for row in &rows {
            assert_eq!(row.kind, kind);
            let place = Vector3::from(row.position);
            let nearest = points.iter().map(|point| (point - place).norm());
            assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-9, "{row:?}");
            assert!((row.time_on - TOUCH).abs() < 1e-9, "{row:?}");
        }
        for (k, sign) in [(0, 1.0), (1, -1.0)] {
            let body = &bodies[k];
            let change = body.mass * (velocity[k] - body.velocity);
            let expected = sign * impulse * normal;
            let astray = (change - expected).norm() / impulse;
            let moment: Vector3<f64> = rows
                .iter()
                .map(|row| {
                    let arm = Vector3::from(row.position) - body.centre();
                    arm.cross(&normal) * sign * row.normal_impulse
                })
                .sum();
            let turned = body.inertia() * spin[k];
            let size = body.centre().norm() * impulse;
            let twisted = (turned - moment).norm() / size;
            println!("  block {k}: momentum astray by {astray:.1e}, moment by {twisted:.1e}");
            // During the contact of 1 ms, blocks rotate and points slip by 2e-4.
            assert!(astray < 2e-4, "{astray}");
            assert!(twisted < 4e-4, "{twisted}");
        }
    }
}

/// The tolerance decides which features count as in contact. A bounce does not depend on it, from a
/// fifth of the default to ten times the default, as the schema states. With a smaller tolerance,
/// vibrating flush faces separate and touch again.
#[test]
fn a_bounce_does_not_depend_on_the_tolerance() {
    for kind in KINDS {
        let usual = bounce(&scene(kind));
        let mut case = scene(kind);
        let simulation = case.start();
        let tolerance = simulation.scene().contact.tolerance.expect("filled in");
        for share in [0.2, 0.5, 2.0, 10.0] {
            case.scene.contact.tolerance = Some(share * tolerance);
            let found = bounce(&case);
            let kinds =
                |bounce: &Bounce| bounce.rows.iter().map(|row| row.kind).collect::<Vec<_>>();
            assert_eq!(kinds(&found), kinds(&usual), "{share}");
            let apart = (0..2).map(|k| {
                let velocity = (found.velocity[k] - usual.velocity[k]).norm();
                velocity.max((found.spin[k] - usual.spin[k]).norm())
            });
            let apart = apart.fold(0.0, f64::max);
            println!(
                "{}, tolerance times {share}: {apart:.1e} m/s apart",
                kind.name()
            );
            // Of 0.2 m/s: pairs join the same event within a 1e-4th of the tolerance, at most a
            // 1e-7th of the block size.
            assert!(apart < 1e-8, "{apart}");
        }
    }
}

/// Sorts the contacts of a rotated scene along a direction in which no two lie level.
fn sort_rows(rows: &mut [ContactRow], by: &Rotation3<f64>) {
    let direction = by * Vector3::new(1.0, 0.7, 0.0);
    let along = |row: &ContactRow| direction.dot(&Vector3::from(row.position));
    rows.sort_by(|a, b| along(a).total_cmp(&along(b)));
}

/// Rotates the whole scene.
fn turned(mut case: Case, by: &Rotation3<f64>) -> Case {
    for block in &mut case.scene.block {
        let axis = Unit::new_normalize(Vector3::from(block.rotate.axis));
        let whole = by * Rotation3::from_axis_angle(&axis, block.rotate.angle);
        let (axis, angle) = whole.axis_angle().expect("turned by some angle");
        (block.rotate.axis, block.rotate.angle) = (axis.into_inner().into(), angle);
        for vector in [&mut block.translate, &mut block.velocity] {
            let turned = by * Vector3::from_column_slice(vector);
            *vector = turned.as_slice().to_vec();
        }
    }
    case
}

#[test]
fn neither_order_nor_direction_matters() {
    for kind in KINDS {
        let straight = bounce(&scene(kind));
        let mut swapped = scene(kind);
        swapped.scene.block.reverse();
        let axis = Unit::new_normalize(Vector3::new(0.3, -0.5, 0.8));
        let by = Rotation3::from_axis_angle(&axis, 1.1);
        let cases = [
            ("swapped", bounce(&swapped), Rotation3::identity()),
            ("turned", bounce(&turned(scene(kind), &by)), by),
        ];
        for (what, mut other, by) in cases {
            sort_rows(&mut other.rows, &by);
            assert_eq!(
                straight.rows.len(),
                other.rows.len(),
                "{} {what}",
                kind.name()
            );
            let mut worst = 0.0_f64;
            for (a, b) in straight.rows.iter().zip(&other.rows) {
                assert_eq!(a.kind, b.kind);
                worst = worst.max((a.normal_impulse / b.normal_impulse - 1.0).abs());
            }
            for k in 0..2 {
                worst = worst.max((by * straight.velocity[k] - other.velocity[k]).norm());
                worst = worst.max((by * straight.spin[k] - other.spin[k]).norm());
            }
            println!("{} {what}: off by {worst:.1e}", kind.name());
            // Round-off of the positions of the blocks, 1e-16 m, over the displacement of the first
            // step, 2e-5 m, and growth during the bounce.
            assert!(worst < 1e-11, "{worst}");
        }
    }
}
