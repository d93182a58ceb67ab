//! What refinement to each level comes to, against meshes that are as fine throughout:
//! the table of the design, section 6, and its counterpart in space.

use cdem::mesh::ElementKind;
use cdem::scene::Mass;
use cdem_verify::Case;

use crate::prisms::{Outcome, Prisms};

/// So small that `max_level` alone says how deep refinement goes.
const NO_LOSS: f64 = 1e-9;

/// What is booked as lost while a point slides along a face that bends, of the energy: one
/// way or the other, as it goes over the nodes.
const HELD: f64 = 1e-4;

/// A zone as deep as it may be.
fn graded(element: ElementKind, level: u32, mass: Mass) -> Outcome {
    let prisms = Prisms {
        gap: 0.01,
        ..Prisms::whole(element)
    };
    let mut case = prisms.two_scale(NO_LOSS);
    case.scene.contact.max_level = level;
    bounce(&prisms, case, mass)
}

/// All elements as wide as the finest of a zone, and as thick as wide, or as the prism.
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

/// Prints the table of an element and a mass; returns its rows.
fn table(element: ElementKind, mass: Mass, levels: u32) -> Vec<[Outcome; 2]> {
    println!("{}, mass {mass:?}: graded, uniform", element.name());
    let row = |level| {
        let row = [graded, uniform].map(|way| way(element, level, mass));
        println!("| {level} | {} {}", row[0].columns(), row[1].columns());
        row
    };
    (0..=levels).map(row).collect()
}

/// The struck block leaves no slower than if all were refined, to a `bound`, m/s; no more is
/// lost at the touch: bisection does not make the elements of a division by rows. A block of
/// one element that is halved once has too few nodes for its moments, unless its masses are
/// lumped: it stays as it is.
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

/// With the same masses, it is no faster either, and no less is lost.
fn check_twins(rows: &[[Outcome; 2]], bound: f64) {
    for [graded, uniform] in rows {
        let faster = graded.struck - uniform.struck;
        assert!(faster < bound, "{graded:?} {uniform:?}");
        let saved = 0.8 * uniform.impact_loss - graded.impact_loss;
        assert!(saved < HELD, "{graded:?} {uniform:?}");
    }
}

/// What a level adds to the updates of a coarse step is those of no more elements than
/// `most`, at the step of that level; with each level `growth` times as many.
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

/// In the plane a zone ends at a point: a level is some rings of elements, of which there
/// are as many in each. Throughout a block each level has four times as many.
#[test]
fn triangles_refined_to_each_level() {
    for mass in [Mass::Lumped, Mass::Auto] {
        let rows = table(ElementKind::Tri3, mass, 6);
        // A block that is refined elsewhere vibrates otherwise: 0.3 % of 3 m/s.
        check_physics(&rows, 0.01);
        if mass == Mass::Lumped {
            check_twins(&rows, 0.01);
        }
        // 49 at most.
        check_cost(rows.iter().map(|row| &row[0]), 55.0, 1.0);
        let [zone, all] = &rows[6];
        assert!(10 * zone.updates < all.updates, "{zone:?} {all:?}");
    }
}

/// In space a zone ends at a line, along which there are twice as many with each level.
/// Throughout a block there are eight times as many once they are as thick as wide.
#[test]
#[ignore = "slow study: ten seconds, the table in space"]
fn prisms_refined_to_each_level() {
    for (element, mass, levels) in [
        (ElementKind::Wedge6, Mass::Auto, 4),
        (ElementKind::Wedge6, Mass::Lumped, 4),
        (ElementKind::Tet4, Mass::Auto, 4),
    ] {
        let rows = table(element, mass, levels);
        // As in the plane, but of elements eight times as wide as thick: 1 % of 3 m/s.
        check_physics(&rows, 0.03);
        // 210 at the first level, 603 at the second.
        check_cost(rows.iter().map(|row| &row[0]), 350.0, 2.0);
    }
}
