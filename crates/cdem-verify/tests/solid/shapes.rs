//! The six contact types between elements of every kind, each above and below, whole and divided.

use cdem_verify::{deepest_overlap, run};
use nalgebra::Vector3;

use crate::meeting::{Feature, PAIRS, Posed, SHAPES, case, kind_of, points, start};

/// Runs an impact of two bodies; checks its first touch and its penetration.
fn meet(hammer: &Posed, anvil: &Posed, features: [Feature; 2]) -> [f64; 2] {
    let name = format!(
        "{features:?}: {:?} on {:?} of {} pieces",
        hammer.body.kind, anvil.body.kind, anvil.body.pieces
    );
    let expected = points(hammer, anvil);
    // A very short step, in which faces do not bulge after first touch; flat edges would cross.
    let mut brief = case(1e-4, 4e-3);
    brief.scene.time.step = Some(1e-6);
    let mut simulation = start(&brief, hammer, anvil);
    let tolerance = simulation.scene().contact.tolerance.expect("filled in");
    while simulation.contacts_begun() == 0 {
        simulation.step().expect("it is stable");
    }
    // Points of a face that the impact of others separates end in the same step.
    let mut rows = simulation.live_contacts();
    rows.extend(simulation.ended_contacts());
    assert_eq!(rows.len(), expected.len(), "{name}: {rows:?}");
    for row in &rows {
        assert_eq!(row.kind, kind_of(features), "{name}: {row:?}");
        // Corners on corners or edges touch at a hundredth of the tolerance, and the blocks may
        // slide by part of that first.
        let place = Vector3::from(row.position);
        let nearest = expected.iter().map(|point| (point - place).norm());
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.1 * tolerance, "{name}: {row:?}");
    }
    let mut overlap = 0.0_f64;
    let mut simulation = start(&case(1e-4, 4e-3), hammer, anvil);
    run(&mut simulation, |simulation| {
        if simulation.step_index() % 8 == 0 {
            overlap = overlap.max(deepest_overlap(&simulation.frame()));
        }
    });
    [overlap, simulation.max_penetration()].map(|depth| depth / tolerance)
}

#[test]
fn every_type_between_every_two_shapes() {
    let began = std::time::Instant::now();
    let mut worst = [0.0_f64; 2];
    let mut count = 0;
    for pieces in [1, 2] {
        for features in PAIRS {
            for below in SHAPES {
                for above in SHAPES {
                    let hammer = Posed::new(above, features[0], (true, 0.4, 1));
                    let anvil = Posed::new(below, features[1], (false, 1.5, pieces));
                    let depths = meet(&hammer, &anvil, features);
                    worst = [0, 1].map(|k| worst[k].max(depths[k]));
                    count += 1;
                }
            }
        }
    }
    println!(
        "{count} meetings in {:.1?}: overlap and penetration {worst:.2?} of the tolerance",
        began.elapsed()
    );
    assert!(worst.iter().all(|&depth| depth <= 1.0), "{worst:?}");
}
