//! Two bars end to end in 3-D compared with wave theory, on matching and non-matching meshes.

use std::time::Instant;

use cdem::mesh::ElementKind::{self, Hex8, Tet4};
use cdem::scene::{Boundary, BoundaryTarget, Motion, Schedule};
use cdem_verify::problems::bars::Collision;
use cdem_verify::{Case, fit, load};

use crate::bars::check;

/// Element and number across, of the left and the right bar; ten times as many along.
type Bars = [(ElementKind, usize); 2];

fn meet(of: Bars) -> Collision {
    meet_between(of, |_| {})
}

fn meet_between(of: Bars, change: impl Fn(&mut Case)) -> Collision {
    let began = Instant::now();
    let mut case = load("two-bars-3d");
    for (name, (element, rows)) in ["left", "right"].into_iter().zip(of) {
        case.divide(name, &[10 * rows, rows, rows], element);
    }
    change(&mut case);
    let figures = Collision::of_equal_bars(&case);
    println!("{of:?}: {figures} in {:.1?}", began.elapsed());
    figures
}

/// Checks the tighter bounds of the scene file for hexahedra.
fn check_hexahedra(figures: &Collision) {
    check(figures);
    assert!((figures.duration - 1.0).abs() < 0.02, "{figures}");
    assert!(figures.lateral < 1e-6, "{figures}");
}

#[test]
fn matching_hexahedra_give_the_force_of_wave_theory() {
    let figures = meet([(Hex8, 4), (Hex8, 4)]);
    check_hexahedra(&figures);
    // Two layers of half an element: (5) gives h/(4L), h = L/40.
    let exact = 1.0 / 160.0;
    assert!((figures.loss / exact - 1.0).abs() < 0.01, "{figures}");
}

#[test]
fn hexahedra_need_not_match() {
    check_hexahedra(&meet([(Hex8, 4), (Hex8, 5)]));
}

/// Puts the sides of both bars on rollers, which changes nothing in theory.
fn hold_sides(case: &mut Case) {
    for bar in ["left", "right"] {
        for (component, axis) in [(1, 'y'), (2, 'z')] {
            for end in ["min", "max"] {
                let mut velocity = [None, None, None];
                velocity[component] = Some(Schedule::Constant(0.0));
                case.scene.boundary.push(Boundary {
                    target: BoundaryTarget::Group(format!("{bar}.{axis}{end}")),
                    motion: Motion::Velocity(velocity),
                    start: 0.0,
                    end: None,
                });
            }
        }
    }
}

#[test]
fn tetrahedra_meet_hexahedra() {
    // Tetrahedra lack the symmetry of the bar. With free sides, the edges of the two end faces
    // would not stay on each other.
    for of in [[(Tet4, 4), (Hex8, 4)], [(Tet4, 3), (Hex8, 4)]] {
        check(&meet_between(of, hold_sides));
    }
}

#[test]
#[ignore = "slow study: finer bars in space"]
fn finer_bars_come_nearer_to_wave_theory() {
    let mut points = Vec::new();
    for rows in [2, 4, 8] {
        let figures = meet([(Hex8, rows), (Hex8, rows + rows / 2)]);
        points.push(((rows as f64).ln(), (figures.duration - 1.0).ln()));
    }
    let order = -fit::slope(&points);
    println!("order of the duration {order:.2}");
    // The front is a few elements long at any fineness: h^(2/3).
    assert!(order > 0.6, "{order}");
}
