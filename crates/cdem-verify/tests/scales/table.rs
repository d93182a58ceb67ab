//! Refinement to each level, compared with meshes that are as fine throughout, in 2-D and 3-D.

use cdem::mesh::ElementKind;
use cdem::scene::Mass;
use cdem_verify::Case;

use crate::prisms::{Outcome, Prisms};

/// So small that `max_level` alone limits the refinement.
const NO_LOSS: f64 = 1e-9;

/// Largest impact loss of a point that slides along a bending face and over its nodes, over the
/// energy. It may have either sign.
const HELD: f64 = 1e-4;

/// Runs with a refinement zone of the largest depth.
fn graded(element: ElementKind, level: u32, mass: Mass) -> Outcome {
    let prisms = Prisms {
        gap: 0.01,
        ..Prisms::whole(element)
    };
    let mut case = prisms.two_scale(NO_LOSS);
    case.scene.contact.max_level = level;
    bounce(&prisms, case, mass)
}

/// Runs with all elements as wide as the finest of a zone. They are as thick as wide, or as thick
/// as the prism.
fn uniform(element: ElementKind, level: u32, mass: Mass) -> Outcome {
    let pieces = 1 << level;
    let prisms = Prisms {
        pieces,
        layers: (pieces / 8).max(1),
        gap: 0.01,
        ..Prisms::whole(element)
    };
    bounce(&prisms, prisms.case(), mass)
}

fn bounce(prisms: &Prisms, mut case: Case, mass: Mass) -> Outcome {
    case.scene.time.end = 0.025;
    for block in &mut case.scene.block {
        block.mass = mass;
    }
    prisms.run(&case)
}

impl Outcome {
    fn columns(&self) -> String {
        format!(
            "{} | {:.4} | {:.3} % | {:.2} | {} |",
            self.elements[0],
            self.struck,
            100.0 * self.impact_loss,
            1e3 * (self.parted - self.touch),
            self.updates
        )
    }
}

/// Prints the table for an element and a mass; returns its rows.
fn table(element: ElementKind, mass: Mass, levels: u32) -> Vec<[Outcome; 2]> {
    println!("{}, mass {mass:?}: graded, uniform", element.name());
    let row = |level| {
        let row = [graded, uniform].map(|way| way(element, level, mass));
        println!("| {level} | {} {}", row[0].columns(), row[1].columns());
        row
    };
    (0..=levels).map(row).collect()
}

/// The struck block is not slower than with uniform refinement, to within `bound`, m/s, and the
/// impact loss is not larger; bisection gives other elements than a division by rows. A block of
/// one element that is halved once has too few nodes for its moments of inertia, unless masses are
/// lumped. It then stays unrefined.
fn check_physics(rows: &[[Outcome; 2]], bound: f64) {
    let refined = |row: &&[Outcome; 2]| row[0].elements[0] > 2;
    assert!(rows.iter().filter(refined).count() + 2 >= rows.len());
    for [graded, uniform] in rows.iter().filter(refined) {
        let slower = uniform.struck - graded.struck;
        assert!(slower < bound, "{graded:?} {uniform:?}");
        let loss = graded.impact_loss - 1.25 * uniform.impact_loss;
        assert!(loss < HELD, "{graded:?} {uniform:?}");
    }
}

/// With the same masses the struck block is not faster either, and the impact loss is not smaller.
fn check_twins(rows: &[[Outcome; 2]], bound: f64) {
    for [graded, uniform] in rows {
        let faster = graded.struck - uniform.struck;
        assert!(faster < bound, "{graded:?} {uniform:?}");
        let saved = 0.8 * uniform.impact_loss - graded.impact_loss;
        assert!(saved < HELD, "{graded:?} {uniform:?}");
    }
}

/// Checks that each level adds the updates of at most `most` elements at its own step. The limit
/// grows by `growth` per level.
fn check_cost<'a>(levels: impl Iterator<Item = &'a Outcome>, mut most: f64, growth: f64) {
    let levels: Vec<&Outcome> = levels.collect();
    for pair in levels.windows(2) {
        let added = pair[1].updates as f64 - pair[0].updates as f64;
        let elements = added / f64::from(1_u32 << pair[1].level);
        println!("a level adds {elements:.0} elements");
        assert!(elements < most, "{pair:?}");
        most *= growth;
    }
}

/// In 2-D a zone surrounds a point: each level adds some rings with the same number of elements.
/// Uniform refinement has four times as many with each level.
#[test]
fn triangles_refined_to_each_level() {
    for mass in [Mass::Lumped, Mass::Auto] {
        let rows = table(ElementKind::Tri3, mass, 6);
        // A block with a different mesh vibrates differently: 0.3 % of 3 m/s.
        check_physics(&rows, 0.01);
        if mass == Mass::Lumped {
            check_twins(&rows, 0.01);
        }
        // 49 at most were measured.
        check_cost(rows.iter().map(|row| &row[0]), 55.0, 1.0);
        let [zone, all] = &rows[6];
        assert!(10 * zone.updates < all.updates, "{zone:?} {all:?}");
    }
}

/// In 3-D a zone surrounds a line, so each level has twice as many elements. Uniform refinement has
/// eight times as many once the elements are as thick as wide.
#[test]
#[ignore = "slow study: ten seconds, the table in space"]
fn prisms_refined_to_each_level() {
    for (element, mass, levels) in [
        (ElementKind::Wedge6, Mass::Auto, 4),
        (ElementKind::Wedge6, Mass::Lumped, 4),
        (ElementKind::Tet4, Mass::Auto, 4),
    ] {
        let rows = table(element, mass, levels);
        // As in 2-D, but with elements eight times as wide as thick: 1 % of 3 m/s.
        check_physics(&rows, 0.03);
        // 210 at the first level, 603 at the second.
        check_cost(rows.iter().map(|row| &row[0]), 350.0, 2.0);
    }
}
