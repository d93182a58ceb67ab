//! Two bars end to end compared with wave theory, on matching and non-matching meshes.

use cdem::mesh::ElementKind;
use cdem_verify::problems::bars::Collision;
use cdem_verify::{Case, load};

/// Builds bars with `rows` elements across and ten times as many along.
fn bars(rows: [usize; 2], element: ElementKind) -> Case {
    let mut case = load("two-bars");
    for (name, rows) in ["left", "right"].into_iter().zip(rows) {
        case.divide(name, &[10 * rows, rows], element);
    }
    case
}

/// Checks the bounds given in the scene file.
pub(crate) fn check(figures: &Collision) {
    assert!((figures.duration - 1.0).abs() < 0.03, "{figures}");
    assert!((figures.mean - 1.0).abs() < 0.005, "{figures}");
    assert!(figures.deviation < 0.03, "{figures}");
    assert!(figures.peak < 1.1, "{figures}");
    // Waves two elements long follow the front if the meshes differ.
    assert!(figures.front < 1.15, "{figures}");
    assert!(figures.lateral < 0.01, "{figures}");
    check_sums(figures);
    check_ledger(figures);
}

fn check_sums(figures: &Collision) {
    assert!(figures.velocities[1] > 0.96, "{figures}");
    assert!(figures.balance.momentum < 1e-12, "{figures}");
}

/// Checks the limit of the ledger for blocks of 40 elements or more.
fn check_ledger(figures: &Collision) {
    assert!(figures.balance.residual < 1e-3, "{figures}");
}

#[test]
fn matching_bars_give_the_force_of_wave_theory() {
    for element in [ElementKind::Quad4, ElementKind::Tri3] {
        let figures = Collision::of_equal_bars(&bars([4, 4], element));
        println!("{element:?} 4/4: {figures}");
        check(&figures);
        // Two rows of half an element: (5) gives h/(4L), h = L/40. At the ends of a side one
        // triangle meets two, each with a third of such a node: 2·(1·2)/(1 + 2) + 3·(3·3)/(3 + 3)
        // for 4·(3·3)/(3 + 3).
        let share = match element {
            ElementKind::Tri3 => 35.0 / 36.0,
            _ => 1.0,
        };
        let exact = share / 160.0;
        assert!((figures.loss / exact - 1.0).abs() < 0.01, "{figures}");
    }
}

#[test]
fn nodes_need_not_match() {
    for element in [ElementKind::Quad4, ElementKind::Tri3] {
        for rows in [[4, 5], [4, 7], [4, 8]] {
            let figures = Collision::of_equal_bars(&bars(rows, element));
            println!("{element:?} {rows:?}: {figures}");
            check(&figures);
        }
    }
}
