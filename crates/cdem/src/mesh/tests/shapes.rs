//! Tests of boxes and polygons.

use proptest::prelude::*;

use crate::mesh::tests::*;
use crate::mesh::{ElementKind, Facet};

fn cuboid(max: &[f64], divisions: &[usize], element: ElementKind) -> Geometry {
    let min = vec![0.0; max.len()];
    Geometry::Box {
        min,
        max: max.to_vec(),
        divisions: divisions.to_vec(),
        element,
    }
}

fn polygon(corners: &[[f64; 2]], size: f64, element: ElementKind) -> Geometry {
    Geometry::Polygon {
        corners: corners.to_vec(),
        size,
        element,
    }
}

/// Returns the length of an edge or the area of a face, by Newell's formula.
fn facet_size<const D: usize>(mesh: &Mesh<D>, facet: Facet) -> f64 {
    let at = |n: u32| {
        let place = mesh.nodes[n as usize];
        [place[0], place[1], place.get(2).copied().unwrap_or(0.0)]
    };
    let nodes: Vec<_> = mesh.facet_nodes(facet).map(at).collect();
    if D == 2 {
        return crate::mesh::vector::distance(nodes[0], nodes[1]);
    }
    let mut normal = [0.0; 3];
    for (k, a) in nodes.iter().enumerate() {
        let b = nodes[(k + 1) % nodes.len()];
        for (i, component) in normal.iter_mut().enumerate() {
            let (j, l) = ((i + 1) % 3, (i + 2) % 3);
            *component += 0.5 * (a[j] - b[j]) * (a[l] + b[l]);
        }
    }
    crate::mesh::vector::distance(normal, [0.0; 3])
}

/// Checks that a box fills its volume, that its boundary is exactly its surface (so every other
/// facet is shared by exactly two elements), and that its sides cover it.
fn check_box<const D: usize>(max: &[f64], divisions: &[usize], element: ElementKind) {
    let mesh = shapes::<D>(vec![block("b", cuboid(max, divisions, element))]).expect("a box");
    let expected: f64 = max.iter().product();
    // Sums of up to some thousand terms of equal sign.
    let tolerance = 1e-11;
    assert!((total_volume(&mesh) / expected - 1.0).abs() < tolerance);
    assert!(mesh.elements.iter().all(|e| volume(&mesh, e) > 0.0));
    let boundary = mesh.boundary_facets();
    let surface: f64 = boundary.iter().map(|&f| facet_size(&mesh, f)).sum();
    let mut sides = 0.0;
    for (axis, letter) in ["x", "y", "z"].iter().enumerate().take(D) {
        let side: f64 = (0..D).filter(|&i| i != axis).map(|i| max[i]).product();
        for (end, level) in [("min", 0.0), ("max", max[axis])] {
            let group = mesh.group(&format!("b.{letter}{end}")).expect("a side");
            let covered: f64 = group.facets.iter().map(|&f| facet_size(&mesh, f)).sum();
            assert!((covered / side - 1.0).abs() < tolerance, "{letter}{end}");
            assert!(
                group
                    .nodes
                    .iter()
                    .all(|&n| mesh.nodes[n as usize][axis] == level)
            );
            sides += side;
        }
    }
    assert!((surface / sides - 1.0).abs() < tolerance);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn flat_boxes_fill_their_area_and_conform(
        max in prop::array::uniform2(0.1..10.0_f64),
        divisions in prop::array::uniform2(1..12_usize),
    ) {
        for element in [ElementKind::Tri3, ElementKind::Quad4] {
            check_box::<2>(&max, &divisions, element);
        }
    }

    #[test]
    fn boxes_fill_their_volume_and_conform(
        max in prop::array::uniform3(0.1..10.0_f64),
        divisions in prop::array::uniform3(1..5_usize),
    ) {
        for element in [ElementKind::Tet4, ElementKind::Wedge6, ElementKind::Hex8] {
            check_box::<3>(&max, &divisions, element);
        }
    }

    /// Stars are simple polygons, convex or not, in either orientation.
    #[test]
    fn polygons_are_filled_to_their_sides(
        radii in prop::collection::vec(0.5..2.0_f64, 3..9),
        size in 0.15..1.0_f64,
        clockwise in any::<bool>(),
    ) {
        let count = radii.len();
        let mut corners: Vec<_> = radii.iter().enumerate().map(|(k, radius)| {
            let angle = std::f64::consts::TAU * k as f64 / count as f64;
            [radius * angle.cos(), radius * angle.sin()]
        }).collect();
        if clockwise {
            corners.reverse();
        }
        let side = |k: usize| (corners[k], corners[(k + 1) % count]);
        let area = (0..count).map(|k| {
            let (a, b) = side(k);
            (a[0] * b[1] - a[1] * b[0]) / 2.0
        }).sum::<f64>().abs();
        for element in [ElementKind::Tri3, ElementKind::Quad4] {
            let shape = polygon(&corners, size, element);
            let mesh = shapes::<2>(vec![block("p", shape)]).expect("a polygon");
            // Sums of some hundred terms of equal sign.
            prop_assert!((total_volume(&mesh) / area - 1.0).abs() < 1e-11);
            prop_assert!(mesh.elements.iter().all(|e| volume(&mesh, e) > 0.0));
            let boundary = mesh.boundary_facets();
            let longest = boundary.iter().map(|&f| facet_size(&mesh, f)).fold(0.0, f64::max);
            prop_assert!(longest <= size * (1.0 + 1e-9), "{longest}");
            for k in 0..count {
                let (a, b) = side(k);
                let group = mesh.group(&format!("p.edge{}", k + 1)).expect("a side");
                let covered: f64 = group.facets.iter().map(|&f| facet_size(&mesh, f)).sum();
                let length = crate::mesh::vector::distance(a, b);
                prop_assert!((covered / length - 1.0).abs() < 1e-11);
            }
        }
    }
}

#[test]
fn an_equilateral_triangle_of_its_own_size_is_one_element() {
    let height = 4.0 * 3.0_f64.sqrt();
    let corners = [[0.0, 0.0], [-height, 4.0], [-height, -4.0]];
    let mesh = shapes::<2>(vec![block("i", polygon(&corners, 8.0, ElementKind::Tri3))]);
    assert_eq!(mesh.expect("a triangle").elements.len(), 1);
}

#[test]
fn meshing_twice_gives_the_same() {
    let corners = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 1.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [0.0, 3.0],
    ];
    let make = || {
        let shape = polygon(&corners, 0.1, ElementKind::Tri3);
        shapes::<2>(vec![block("l", shape)]).expect("an L")
    };
    let first = make();
    assert!(first.elements.len() > 500);
    assert_eq!(first, make());
}

#[test]
fn shapes_that_cannot_be_say_why() {
    use ElementKind::{Hex8, Quad4, Tri3};
    let cases = [
        cuboid(&[1.0, 1.0], &[2, 0], Tri3),
        cuboid(&[1.0, -1.0], &[2, 2], Tri3),
        cuboid(&[1.0, 1.0, 1.0], &[2, 2], Tri3),
        cuboid(&[1.0, 1.0], &[1_000_000, 1_000_000], Quad4),
        cuboid(&[1.0, 1.0], &[2, 2], Hex8),
        polygon(&[[0.0, 0.0], [1.0, 0.0]], 0.1, Tri3),
        polygon(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], 0.1, Tri3),
        polygon(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 0.1, Tri3),
        polygon(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 0.1, Tri3),
        polygon(&[[0.0, 0.0], [1.0, 0.0], [0.0, f64::NAN]], 0.1, Tri3),
        polygon(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 0.0, Tri3),
        polygon(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 1e-6, Tri3),
    ];
    let messages = cases.map(|shape| {
        let error = shapes::<2>(vec![block("b", shape)]).expect_err("a bad shape");
        error.to_string()
    });
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn triangles_of_a_box_load_the_nodes_of_a_side_alike() {
    let geometry = cuboid(&[3.0, 2.0], &[6, 5], ElementKind::Tri3);
    let mesh = shapes::<2>(vec![block("b", geometry)]).expect("a box");
    for side in ["xmin", "xmax", "ymin", "ymax"] {
        let nodes = &mesh.group(&format!("b.{side}")).expect("a side").nodes;
        let around = |node: &u32| {
            let elements = mesh.elements.iter();
            elements.filter(|e| e.nodes().contains(node)).count()
        };
        let mut counts: Vec<usize> = nodes.iter().map(around).collect();
        counts.sort_unstable();
        let inner = counts.split_off(2);
        assert!(counts.iter().all(|&n| n < 3), "{side}: {counts:?}");
        assert!(inner.iter().all(|&n| n == 3), "{side}: {inner:?}");
    }
}
