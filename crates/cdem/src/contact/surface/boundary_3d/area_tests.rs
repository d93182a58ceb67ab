//! Tributary areas of the contacts of flush boxes.

use proptest::prelude::*;

use crate::contact::narrow_phase::feature_selection::are_one_contact;
use crate::contact::narrow_phase::tributary_area::common_area;
use crate::contact::surface::boundary_3d::tests::all_pairs;
use crate::contact::surface::boundary_3d::{Boundary3d, FeaturePair};
use crate::contact::surface::contact_kind::ContactKind;
use crate::contact::surface::{Configuration, ContactGeometry, Distance, Pair};
use crate::mesh::{self, ElementKind, Mesh};
use crate::scene::Geometry;

/// Closes touching pairs: the contacts of two blocks, each once.
fn contacts_of(boundary: &Boundary3d, at: Configuration<3>, resolution: f64) -> Vec<Pair> {
    let mut contacts: Vec<Pair> = Vec::new();
    for pair in all_pairs(boundary) {
        let projection = boundary.project(pair, at);
        let touches = projection.gap.abs() <= resolution && projection.outside <= resolution;
        let counts = match boundary.feature_pair(pair) {
            FeaturePair::EdgeEdge { main, target } => [main, target]
                .iter()
                .all(|&edge| boundary.triangulation.is_sharp(edge, at)),
            FeaturePair::PointTriangle { .. } => true,
        };
        let known = |other: &Pair| {
            let blocks = [*other, pair].map(|pair| boundary.blocks(pair));
            are_one_contact(boundary, [*other, pair], blocks, at, resolution)
        };
        if touches && counts && boundary.in_normal_cone(pair, at) && !contacts.iter().any(known) {
            contacts.push(pair);
        }
    }
    contacts
}

/// Faces that end together are no contact, though their edges cross where the blocks touch.
#[test]
fn stacked_cubes_touch_along_the_vertical_only() {
    let cube = |name: &str, low: f64| {
        let geometry = Geometry::Box {
            min: vec![0.0, 0.0, low],
            max: vec![1.0, 1.0, low + 1.0],
            divisions: vec![2; 3],
            element: ElementKind::Hex8,
        };
        mesh::tests::block(name, geometry)
    };
    let blocks = vec![cube("below", -1.0), cube("above", 0.0)];
    let mesh: Mesh<3> = mesh::tests::shapes(blocks).expect("boxes mesh");
    let still = vec![[0.0; 3]; mesh.nodes.len()];
    let at = Configuration::new(&mesh.nodes, &still);
    let boundary = Boundary3d::new(&mesh, 1e-6);
    let mut crossings = 0;
    for pair in all_pairs(&boundary) {
        let projection = boundary.project(pair, at);
        if projection.gap.abs() > 1e-6 || projection.outside > 1e-6 {
            continue;
        }
        crossings += 1;
        if boundary.in_normal_cone(pair, at) {
            let normal = boundary.normal(pair, at).expect("it has a projection");
            assert!(normal[2].abs() > 1.0 - 1e-12, "{pair:?}: {normal:?}");
        }
    }
    assert!(crossings > 100, "{crossings}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// For two boxes in any position, with any divisions, the contacts of their faces share the
    /// area of the overlap.
    #[test]
    fn contacts_share_the_whole_area(
        shift in [-0.9..0.9_f64, -0.9..0.9_f64],
        angle in prop_oneof![0.0..3.0_f64, (-9.0..-2.0_f64).prop_map(|power| 10.0_f64.powf(power))],
        below in [1..4_usize, 1..4_usize],
        above in [1..4_usize, 1..4_usize],
        triangles in any::<bool>(),
    ) {
        let element = if triangles { ElementKind::Tet4 } else { ElementKind::Hex8 };
        let cube = |name: &str, low: f64, divisions: [usize; 2]| {
            let geometry = Geometry::Box {
                min: vec![-0.5, -0.5, low],
                max: vec![0.5, 0.5, low + 1.0],
                divisions: vec![divisions[0], divisions[1], 1],
                element,
            };
            mesh::tests::block(name, geometry)
        };
        let blocks = vec![cube("below", -1.0, below), cube("above", 0.0, above)];
        let mut mesh: Mesh<3> = mesh::tests::shapes(blocks).expect("boxes mesh");
        let (sine, cosine) = angle.sin_cos();
        for node in mesh.blocks[1].nodes.clone() {
            let [x, y, z] = mesh.nodes[node as usize];
            mesh.nodes[node as usize] =
                [cosine * x - sine * y + shift[0], sine * x + cosine * y + shift[1], z];
        }
        let still = vec![[0.0; 3]; mesh.nodes.len()];
        let at = Configuration::new(&mesh.nodes, &still);
        let boundary = Boundary3d::new(&mesh, 1e-6);
        let contacts = contacts_of(&boundary, at, 1e-6);
        let sum: f64 = contacts.iter().map(|&pair| boundary.classify(pair, at, 1e-6).1).sum();
        let corners = |number: usize| {
            let nodes = mesh.blocks[number].nodes.clone();
            let outer = nodes.filter(|&node| {
                let [x, y, z] = mesh.nodes[node as usize];
                let from = if number == 1 { [x - shift[0], y - shift[1]] } else { [x, y] };
                z == 0.0 && f64::hypot(from[0], from[1]) > 0.7
            });
            let mut outer: Vec<[f64; 2]> = outer
                .map(|node| [mesh.nodes[node as usize][0], mesh.nodes[node as usize][1]])
                .collect();
            let [mx, my] = if number == 1 { shift } else { [0.0; 2] };
            outer.sort_by(|a, b| {
                f64::atan2(a[1] - my, a[0] - mx).total_cmp(&f64::atan2(b[1] - my, b[0] - mx))
            });
            outer
        };
        let common = common_area(&corners(0), &corners(1));
        // Pieces smaller than the resolution have no corners of their own.
        prop_assert!((sum - common).abs() < 1e-5, "{sum} of {common}, {} contacts", contacts.len());
        let kinds = contacts.iter().map(|&pair| boundary.classify(pair, at, 1e-6).0);
        if common > 0.01 {
            for kind in kinds {
                prop_assert_eq!(kind, ContactKind::FaceFace);
            }
        }
    }
}
