//! Faces and edges that land almost flush. Below the angle with sine `FLUSH` they count as flush,
//! and another contact type is reported. Nothing else may change at this angle.

use cdem::mesh::ElementKind;
use cdem::output::ContactKind;
use cdem_verify::{Body, deepest_overlap, run};
use nalgebra::{Rotation3, Vector3};

use crate::meeting::{Feature, Posed, case, start};

/// Sine of the largest angle at which features count as flush.
const FLUSH: f64 = 0.02;

/// Results of a landing.
#[derive(Debug)]
struct Landing {
    kind: ContactKind,
    /// Sum of normal impulses, N·s.
    impulse: f64,
    /// Velocity, m/s, and spin, rad/s, of the falling box.
    motion: [Vector3<f64>; 2],
}

/// Builds two boxes. The upper box is above a face of the lower one, on its own face or (rotated)
/// on its own edge, tilted about y by `tilt`.
fn boxes(feature: Feature, tilt: f64) -> [Posed; 2] {
    let mut rotation = Rotation3::from_axis_angle(&Vector3::y_axis(), tilt);
    if feature == Feature::Edge {
        rotation *= Rotation3::from_axis_angle(&Vector3::x_axis(), 0.6);
    }
    let corners = |low: [f64; 3], high: [f64; 3]| {
        let around = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let corners = [0, 1].map(|z| around.map(|[x, y]| [x, y, z])).concat();
        let place = move |corner: [usize; 3]| [0, 1, 2].map(|c| [low[c], high[c]][corner[c]]);
        corners.into_iter().map(place)
    };
    let turned: Vec<_> = corners([-0.5, -0.4, 0.0], [0.4, 0.3, 0.6])
        .map(|corner| rotation * Vector3::from(corner))
        .collect();
    let heights = turned.iter().map(|corner| corner.z);
    let lowest = Vector3::z() * heights.fold(f64::INFINITY, f64::min);
    let upper = turned
        .iter()
        .map(|corner| (corner - lowest).into())
        .collect();
    let lower = corners([-1.0, -0.9, -1.0], [0.9, 1.0, 0.0]).collect();
    [upper, lower].map(|corners| Posed {
        body: Body {
            kind: ElementKind::Hex8,
            corners,
            pieces: 1,
        },
        feature: Vec::new(),
    })
}

/// Runs a landing and checks what holds at any tilt.
fn land(feature: Feature, tilt: f64) -> Landing {
    let [hammer, anvil] = boxes(feature, tilt);
    // Until the far end has landed too.
    let mut simulation = start(&case(1e-4, 0.01 + 20.0 * tilt), &hammer, &anvil);
    let (mut overlap, mut rows) = (0.0_f64, Vec::new());
    while simulation.contacts_begun() == 0 {
        simulation.step().expect("it is stable");
    }
    for normal in simulation.contact_frame().normals {
        // The normal is that of the lower box's face at any tilt of the upper box. It rotates with
        // the strain of the impact, the speed over the wave speed, 1.6e-4.
        assert!(normal[0].hypot(normal[1]) < 3e-4, "{normal:?}");
    }
    run(&mut simulation, |simulation| {
        rows.extend(simulation.ended_contacts());
        if simulation.step_index() % 8 == 0 {
            overlap = overlap.max(deepest_overlap(&simulation.frame()));
        }
    });
    rows.extend(simulation.live_contacts());
    rows.sort_by(|a, b| a.time_on.total_cmp(&b.time_on));
    let tolerance = simulation.scene().contact.tolerance.expect("filled in");
    assert!(overlap <= tolerance && simulation.max_penetration() <= tolerance);
    let block = &simulation.block_rows()[0];
    let motion = [block.velocity, block.angular_velocity].map(Vector3::from);
    let impulse: f64 = rows.iter().map(|row| row.normal_impulse).sum();
    println!(
        "{feature:?} tilted by {tilt:.9}: {}, {impulse:.7} N s",
        rows[0].kind.name()
    );
    Landing {
        kind: rows[0].kind,
        impulse,
        motion,
    }
}

/// Returns the relative difference of two landings.
fn change(one: &Landing, other: &Landing) -> f64 {
    let motion = (0..2).map(|k| (one.motion[k] - other.motion[k]).norm() / 0.2);
    motion.fold((one.impulse / other.impulse - 1.0).abs(), f64::max)
}

/// Tilted feature, and its contact type while it counts as flush and beyond.
const TILTED: [(Feature, ContactKind, ContactKind); 2] = [
    (Feature::Face, ContactKind::FaceFace, ContactKind::EdgeFace),
    (
        Feature::Edge,
        ContactKind::EdgeFace,
        ContactKind::VertexFace,
    ),
];

#[test]
fn landings_do_not_jump_where_features_count_as_flush() {
    for (feature, flush, tilted) in TILTED {
        let border = FLUSH.asin();
        let beside = |share: f64| land(feature, border * (1.0 + share));
        let [near, far] = [1e-9, 1e-6];
        let below = [-far, -near].map(beside);
        let above = [near, far].map(beside);
        assert!(below.iter().all(|landing| landing.kind == flush));
        assert!(above.iter().all(|landing| landing.kind == tilted));
        // The change across the border must be as small as on either side of it. (Faces rattle, so
        // small changes grow by a factor of hundreds until separation.)
        let slopes = [&below, &above].map(|[one, other]| change(one, other) / (far - near));
        let across = change(&below[1], &above[0]) / (2.0 * near);
        println!("{feature:?}: change over that of the tilt {slopes:.1?}, across {across:.1}");
        assert!(
            across < 2.0 * slopes[0].max(slopes[1]),
            "{across} {slopes:?}"
        );
    }
}

#[test]
fn landings_at_all_tilts_keep_their_type_and_tolerance() {
    for (feature, flush, tilted) in TILTED {
        for step in 0..=24 {
            let tilt = 1e-4 * 10_f64.powf(f64::from(step) / 8.0);
            let expected = if tilt.sin() <= FLUSH { flush } else { tilted };
            assert_eq!(land(feature, tilt).kind, expected, "{tilt}");
        }
    }
}
