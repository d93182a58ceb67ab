//! Tests of overlapping blocks.

use crate::mesh::tests::*;
use crate::mesh::{ElementKind, Overlap, overlap};

fn all(_: usize, _: usize) -> bool {
    true
}

fn slab<const D: usize>(name: &str, low: [f64; D], high: [f64; D], cells: usize) -> Block {
    let element = if D == 2 {
        ElementKind::Tri3
    } else {
        ElementKind::Tet4
    };
    let (min, max, divisions) = (low.to_vec(), high.to_vec(), vec![cells; D]);
    block(
        name,
        Geometry::Box {
            min,
            max,
            divisions,
            element,
        },
    )
}

fn of<const D: usize>(blocks: Vec<Block>) -> Option<Overlap<D>> {
    overlap(&shapes::<D>(blocks).expect("blocks"), 1e-3, &all)
}

#[test]
fn neighbours_that_touch_do_not_overlap() {
    let side = slab("a", [0.0; 2], [1.0; 2], 3);
    let other = slab("b", [1.0 - 5e-4, 0.3], [2.0, 1.7], 4);
    let far = slab("c", [5.0; 2], [6.0; 2], 1);
    assert_eq!(of::<2>(vec![side, other, far]), None);
    let side = slab("a", [0.0; 3], [1.0; 3], 2);
    let other = slab("b", [1.0 - 5e-4, 0.3, 0.2], [2.0, 1.7, 0.8], 3);
    assert_eq!(of::<3>(vec![side, other]), None);
}

#[test]
fn a_corner_in_another_block_is_found_with_its_depth() {
    let found = of::<2>(vec![
        slab("a", [0.0; 2], [1.0; 2], 3),
        slab("b", [0.99, 0.4], [2.0, 0.6], 1),
    ]);
    let found = found.expect("an overlap");
    assert_eq!(found.blocks, [1, 0]);
    // 1 − 0.99, with the rounding of numbers of order one.
    assert!((found.depth - 0.01).abs() < 1e-15, "{found:?}");
    let found = of::<3>(vec![
        slab("a", [0.0; 3], [1.0; 3], 2),
        slab("b", [0.98; 3], [2.0; 3], 2),
    ]);
    assert!(
        (found.expect("an overlap").depth - 0.02).abs() < 1e-15,
        "{found:?}"
    );
}

#[test]
fn bars_that_cross_without_corners_inside_are_found() {
    let flat = of::<2>(vec![
        slab("a", [-3.0, -0.5], [3.0, 0.5], 1),
        slab("b", [-0.5, -3.0], [0.5, 3.0], 1),
    ]);
    assert!(flat.expect("an overlap").depth >= 0.25, "{flat:?}");
    let solid = of::<3>(vec![
        slab("a", [-3.0, -0.5, -0.5], [3.0, 0.5, 0.5], 1),
        slab("b", [-0.4, -3.0, -0.4], [0.4, 3.0, 0.4], 1),
    ]);
    assert!(solid.expect("an overlap").depth >= 0.05, "{solid:?}");
}

#[test]
fn a_block_in_another_and_two_in_one_place_are_found() {
    let inside = of::<2>(vec![
        slab("a", [0.0; 2], [9.0; 2], 9),
        slab("b", [4.0; 2], [5.0; 2], 1),
    ]);
    assert!(inside.expect("an overlap").depth >= 4.0, "{inside:?}");
    let same = of::<3>(vec![
        slab("a", [0.0; 3], [1.0; 3], 1),
        slab("b", [0.0; 3], [1.0; 3], 1),
    ]);
    assert!(same.is_some());
}

/// Returns two boxes of one element each; the second is shifted.
fn flush<const D: usize>(element: ElementKind, high: [f64; D], shift: [f64; D]) -> Option<f64> {
    let boxes = [("a", [0.0; D]), ("b", shift)].map(|(name, shift)| {
        let (min, max) = (shift.to_vec(), (0..D).map(|c| high[c] + shift[c]).collect());
        let divisions = vec![1; D];
        block(
            name,
            Geometry::Box {
                min,
                max,
                divisions,
                element,
            },
        )
    });
    of::<D>(boxes.to_vec()).map(|overlap| overlap.depth)
}

#[test]
fn boxes_with_flush_sides_are_found_in_each_other() {
    for depth in [2e-3, 0.1, 0.3] {
        for element in [ElementKind::Hex8, ElementKind::Wedge6, ElementKind::Tet4] {
            let high = [1.0, 0.5, 0.5];
            for shift in [
                [0.0, 0.0, 0.5 - depth],
                [0.5, 0.0, 0.5 - depth],
                [1.0 - depth, 0.0, 0.0],
                [1.0 - depth, 0.5 - depth, 0.0],
                [0.25, 0.125, 0.5 - depth],
            ] {
                let found = flush(element, high, shift);
                assert!(
                    found.is_some_and(|found| found < depth + 1e-12),
                    "{element:?} {shift:?}: {found:?}"
                );
            }
            for shift in [
                [0.0, 0.0, 0.5 - 5e-4],
                [0.5, 0.0, 0.5],
                [1.0 - 5e-4, 0.5, 0.0],
            ] {
                assert_eq!(flush(element, high, shift), None, "{element:?} {shift:?}");
            }
        }
        for element in [ElementKind::Quad4, ElementKind::Tri3] {
            for shift in [[0.0, 0.5 - depth], [0.5, 0.5 - depth], [1.0 - depth, 0.0]] {
                let found = flush(element, [1.0, 0.5], shift);
                assert!(
                    found.is_some_and(|found| found < depth + 1e-12),
                    "{element:?} {shift:?}: {found:?}"
                );
            }
        }
    }
}

#[test]
fn a_notch_may_hold_another_block() {
    let corners = [
        [0., 0.],
        [3., 0.],
        [3., 2.],
        [2., 2.],
        [2., 1.],
        [1., 1.],
        [1., 2.],
        [0., 2.],
    ];
    let u = Geometry::Polygon {
        corners: corners.to_vec(),
        size: 0.5,
        element: ElementKind::Tri3,
    };
    let stone = |low: f64| slab("b", [1.0, low], [2.0, low + 1.0], 2);
    assert_eq!(of::<2>(vec![block("u", u.clone()), stone(1.0)]), None);
    let sunk = of::<2>(vec![block("u", u), stone(0.9)]).expect("an overlap");
    assert!((sunk.depth - 0.1).abs() < 1e-12, "{sunk:?}");
}

#[test]
fn pairs_that_do_not_matter_may_overlap() {
    let blocks = vec![
        slab("a", [0.0; 2], [1.0; 2], 1),
        slab("b", [0.5; 2], [1.5; 2], 1),
    ];
    let mesh = shapes::<2>(blocks).expect("blocks");
    assert!(overlap(&mesh, 1e-3, &all).is_some());
    assert_eq!(overlap(&mesh, 1e-3, &|a, b| a + b != 1), None);
}
