//! Accuracy at equal cost: two-scale impacts against the other models on meshes that are as fine as
//! the same cost allows.

use cdem::mesh::ElementKind;
use nalgebra::Vector3;

use crate::impact::{Figures, Impact, Model, Outcome};

/// Flight before each impact over the contact time: that of the paper's case, half a second for 7
/// ms of contact. A stone that falls from rest flies for longer.
const FLIGHT: f64 = 70.0;

const RIVALS: [Model; 4] = [
    Model::UnifiedNode,
    Model::Penalty(0.1),
    Model::Penalty(1.0),
    Model::Penalty(10.0),
];

/// Flight over the contact time in the runs that measure the cost of flight.
const STRETCH: f64 = 20.0;

/// Number of runs; the fastest counts.
const TIMES: usize = 5;

const BARS: Impact = Impact {
    scene: "two-bars",
    blocks: ["left", "right"],
    along: 0,
    element: ElementKind::Quad4,
    coarsest: &[10, 1],
    fine: [8, 16],
};

const fn plane(scene: &'static str, fine: [usize; 2]) -> Impact {
    Impact {
        scene,
        blocks: ["hammer", "anvil"],
        along: 1,
        element: ElementKind::Quad4,
        coarsest: &[1, 1],
        fine,
    }
}

const fn solid(scene: &'static str) -> Impact {
    Impact {
        scene,
        blocks: ["hammer", "anvil"],
        along: 2,
        element: ElementKind::Hex8,
        coarsest: &[1, 1, 1],
        fine: [16, 20],
    }
}

const CORNER_ON_EDGE: Impact = plane("corner-on-edge", [64, 128]);
const TUMBLING_BLOCK: Impact = plane("tumbling-block", [64, 128]);
const CORNER_ON_FACE: Impact = solid("corner-on-face");
const EDGE_ON_EDGE: Impact = solid("edge-on-edge");
const EDGE_TO_EDGE: Impact = plane("contact-types-2d/edge-edge", [32, 64]);

type Measure = fn(&Outcome) -> f64;

/// The measures of cost.
const MEASURES: [(&str, Measure); 2] = [("updates", |o| o.updates), ("wall time", |o| o.seconds)];

fn percent<const N: usize>(shares: [f64; N]) -> String {
    shares
        .map(|share| format!("{:6.2} |", 100.0 * share))
        .join("")
}

/// Returns the results of the finest mesh; for bars, those of wave theory.
fn reference(impact: &Impact) -> Figures {
    let run = |divisions| impact.run(divisions, Model::UnifiedNode, 0.0, 1);
    let fine = impact.fine.map(run);
    let fine = fine.map(|outcome| outcome.expect("it is stable").figures);
    let apart = fine[0].errors(&fine[1]);
    println!(
        "\n{}: restitution {:.4}, spin {:.3?} rad/s, {:.3} ms on {} divisions; with {} other by {} %",
        impact.scene,
        fine[1].restitution,
        fine[1].spin.as_slice(),
        1e3 * fine[1].duration,
        impact.fine[1],
        impact.fine[0],
        percent(apart),
    );
    // At most a fifth of the largest errors that are compared with it.
    assert!(apart.iter().all(|&error| error < 0.025), "{apart:?}");
    if impact.scene != BARS.scene {
        return fine[1];
    }
    Figures {
        restitution: 1.0,
        spin: Vector3::zeros(),
        duration: 20.0 / (40e9_f64 / 2700.0).sqrt(),
    }
}

/// Runs a model on finer and finer meshes until one costs as much as `two_scale` by both measures.
fn ladder(impact: &Impact, model: Model, flight: f64, two_scale: &Outcome) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for divisions in 1..impact.fine[0] {
        let Some(outcome) = impact.run(divisions, model, flight, TIMES) else {
            println!("{model:?}, {divisions} divisions: stops itself");
            continue;
        };
        outcomes.push(outcome);
        if MEASURES.iter().all(|(_, of)| of(&outcome) >= of(two_scale)) {
            break;
        }
    }
    outcomes
}

fn print(name: &str, outcome: &Outcome, reference: &Figures) {
    println!(
        "{name:24} |{:3} |{:8.0} |{:8.1} |{} lost {}",
        outcome.divisions,
        1e-3 * outcome.updates,
        1e3 * outcome.seconds,
        percent(outcome.figures.errors(reference)),
        percent(outcome.lost),
    );
}

/// Returns the largest error of two-scale, and of each rival on the coarsest mesh with at least as
/// many updates.
fn study(impact: &Impact) -> (f64, Vec<f64>) {
    let reference = reference(impact);
    let flight = FLIGHT * reference.duration;
    println!("divisions, 1000 updates, ms, errors of restitution, spin, duration, %");
    let two_scale = impact.run(1, Model::TwoScale, flight, TIMES);
    let two_scale = two_scale.expect("it is stable");
    print("two-scale", &two_scale, &reference);
    let mut worst = Vec::new();
    for model in RIVALS {
        let outcomes = ladder(impact, model, flight, &two_scale);
        let rivals = MEASURES.map(|(measure, of)| {
            let rival = outcomes.iter().find(|&o| of(o) >= of(&two_scale));
            if let Some(rival) = rival {
                print(&format!("{model:?}, {measure}"), rival, &reference);
            }
            rival
        });
        worst.push(rivals[0].map_or(f64::INFINITY, |o| o.figures.worst(&reference)));
    }
    // Stiff springs may fail on all meshes of this cost; the other models may not.
    let run = worst.iter().filter(|error| error.is_finite()).count();
    assert!(worst[0].is_finite() && run + 1 >= RIVALS.len(), "{worst:?}");
    break_even(impact, &reference);
    (two_scale.figures.worst(&reference), worst)
}

/// Prints the flight per impact above which two-scale costs less than unified nodes on the coarsest
/// mesh of equal accuracy.
fn break_even(impact: &Impact, reference: &Figures) {
    let stretch = STRETCH * reference.duration;
    let run = |divisions, model| impact.run(divisions, model, 0.0, TIMES).expect("stable");
    let fly = |divisions, model| {
        let flight = impact.fly(divisions, model, stretch, TIMES);
        flight.expect("stable")
    };
    let two_scale = run(1, Model::TwoScale);
    print("two-scale, no flight", &two_scale, reference);
    let worst = two_scale.figures.worst(reference);
    let meshes = 1..impact.fine[0];
    let mut rivals = meshes.map(|divisions| run(divisions, Model::UnifiedNode));
    let Some(rival) = rivals.find(|o| o.figures.worst(reference) <= worst) else {
        return println!("no mesh but the finest is as good");
    };
    print("as good, no flight", &rival, reference);
    let flights = [
        fly(1, Model::TwoScale),
        fly(rival.divisions, Model::UnifiedNode),
    ];
    for (measure, of) in MEASURES {
        let saved = of(&flights[1]) - of(&flights[0]);
        let flight = STRETCH * (of(&two_scale) - of(&rival)) / saved;
        println!("{measure}: even with a flight of {flight:.1} contact times, if not below 0");
    }
}

#[test]
#[ignore = "slow study: meshes of tens of thousands of elements"]
fn accuracy_for_its_cost() {
    for impact in [CORNER_ON_EDGE, TUMBLING_BLOCK] {
        let (two_scale, rivals) = study(&impact);
        assert!(
            rivals.iter().all(|&rival| two_scale < rival),
            "{two_scale} {rivals:?}"
        );
    }
    // As good as unified nodes, whose error scatters from 0.016 to 0.051 on 8 to 11 divisions.
    // Two-scale has 0.027, which must not grow, and is better than springs.
    let (two_scale, rivals) = study(&EDGE_TO_EDGE);
    assert!(two_scale < 0.03, "{two_scale} {rivals:?}");
    assert!(
        rivals[1..].iter().all(|&rival| two_scale < rival),
        "{two_scale} {rivals:?}"
    );
    // Soft springs have the right contact time on one mesh, and a wrong one on all finer meshes.
    let (two_scale, rivals) = study(&EDGE_ON_EDGE);
    assert!(two_scale < rivals[0], "{two_scale} {rivals:?}");
    // Not the best by updates, but by wall time; the book gives the reason.
    let (two_scale, rivals) = study(&CORNER_ON_FACE);
    assert!(two_scale < 2.0 * rivals[0], "{two_scale} {rivals:?}");
    // Flush bars gain nothing: the error is 0.066 and must not grow.
    let (two_scale, _) = study(&BARS);
    assert!(two_scale < 0.08, "{two_scale}");
}

/// The error of a corner impact is about half of that with unified nodes at the same cost.
#[test]
fn corners_are_worth_their_cost() {
    for impact in [CORNER_ON_EDGE, TUMBLING_BLOCK] {
        // These differ by 2 % and 7 % from the finest mesh of the study, towards coarser meshes.
        let reference = impact.run(32, Model::UnifiedNode, 0.0, 1).expect("stable");
        let reference = reference.figures;
        let flight = FLIGHT * reference.duration;
        let two_scale = impact.run(1, Model::TwoScale, flight, 1).expect("stable");
        let rivals = (1..32).map(|divisions| {
            let rival = impact.run(divisions, Model::UnifiedNode, flight, 1);
            rival.expect("stable")
        });
        let mut dearer = rivals.filter(|rival| rival.updates >= two_scale.updates);
        let rival = dearer.next().expect("some mesh costs as much");
        print("two-scale", &two_scale, &reference);
        print("unified-node", &rival, &reference);
        let share = two_scale.figures.worst(&reference) / rival.figures.worst(&reference);
        // 0.51 and 0.37 measured; against the finest mesh, 0.57 and 0.53.
        assert!(share < 0.7, "{share}");
    }
}
