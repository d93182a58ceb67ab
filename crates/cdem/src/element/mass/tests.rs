//! Tests of masses against exact inertia.

use crate::element::mass::*;
use crate::element::tests::{Sets, box_mesh, kinds, rock, sets_of};
use crate::mesh::{Element, ElementKind, MeshBlock};
use crate::scene::{Kinematics, Plane};

fn sets<const D: usize>(mesh: &Mesh<D>) -> Sets<D> {
    sets_of(mesh, rock(), Kinematics::Total, Plane::Strain)
}

fn masses<const D: usize>(mesh: &Mesh<D>, mass: Mass) -> Result<Masses, MassError> {
    build(mesh, &sets(mesh), &vec![mass; mesh.blocks.len()])
}

fn made<const D: usize>(mesh: &Mesh<D>, mass: Mass) -> Masses {
    masses(mesh, mass).expect("masses as asked for")
}

/// Creates a block of one simplex.
fn simplex<const D: usize>(nodes: &[[f64; D]], kind: ElementKind) -> Mesh<D> {
    let numbers: Vec<u32> = (0..nodes.len() as u32).collect();
    Mesh {
        nodes: nodes.to_vec(),
        elements: vec![Element::new(kind, &numbers)],
        blocks: vec![MeshBlock {
            name: "lone".into(),
            source: 0,
            nodes: 0..nodes.len() as u32,
            elements: 0..1,
        }],
        ..Mesh::default()
    }
}

/// Returns mass, first and second moments of point masses about the origin.
fn moments<const D: usize>(nodes: &[[f64; D]], masses: &[f64]) -> (f64, [f64; D], [[f64; D]; D]) {
    let (mut first, mut second) = ([0.0; D], [[0.0; D]; D]);
    for (x, m) in nodes.iter().zip(masses) {
        for k in 0..D {
            first[k] += m * x[k];
            for l in 0..D {
                second[k][l] += m * x[k] * x[l];
            }
        }
    }
    (masses.iter().sum(), first, second)
}

#[test]
fn lumping_alone_errs_as_the_design_says() {
    let triangle = simplex(&[[0.1, 0.0], [3.0, 0.5], [1.0, 2.0]], ElementKind::Tri3);
    let corners = [
        [0.0, 0.0, 0.1],
        [2.0, 0.3, 0.0],
        [0.4, 1.5, 0.2],
        [0.5, 0.3, 1.8],
    ];
    let tetrahedron = simplex(&corners, ElementKind::Tet4);
    let cube = box_mesh([2.0; 3], [1; 3], ElementKind::Hex8, 0.6);
    let excess = |masses: Masses| masses.inertia_error[0] + 1.0;
    // 4, 5 and 3 times the true inertia.
    assert!((excess(made(&triangle, Mass::Lumped)) - 4.0).abs() < 1e-12);
    assert!((excess(made(&tetrahedron, Mass::Lumped)) - 5.0).abs() < 1e-12);
    assert!((excess(made(&cube, Mass::Lumped)) - 3.0).abs() < 1e-12);
    for masses in [
        made(&triangle, Mass::Auto),
        made(&tetrahedron, Mass::Auto),
        made(&cube, Mass::Auto),
    ] {
        assert_eq!(masses.kind, [MassKind::Consistent]);
        assert_eq!(masses.inertia_error, [0.0]);
    }
}

/// Compares fitted masses of a rotated box with the closed forms of a solid box.
fn fitted_box_is_exact<const D: usize>(size: [f64; D], divisions: [usize; D]) {
    for kind in kinds::<D>() {
        let mut mesh = box_mesh(size, divisions, kind, 0.9);
        mesh.nodes.iter_mut().for_each(|x| x[0] += 5.0);
        let masses = made(&mesh, Mass::Auto);
        assert_eq!(masses.kind, [MassKind::Fitted], "{kind:?}");
        assert!(
            masses.inertia_error[0] < 1e-12,
            "{kind:?}: {:?}",
            masses.inertia_error
        );

        let thickness = if D == 2 { 0.7 } else { 1.0 };
        let exact_mass = 2500.0 * thickness * size.iter().product::<f64>();
        // Coordinates in the axes of the box, from its centre: shift and rotation undone.
        let turn = crate::element::tests::rotation::<D>(0.9);
        let own: Vec<[f64; D]> = mesh
            .nodes
            .iter()
            .map(|x| {
                let shifted = |i: usize| x[i] - if i == 0 { 5.0 } else { 0.0 };
                std::array::from_fn(|k| {
                    (0..D).map(|i| turn[i][k] * shifted(i)).sum::<f64>() - 0.5 * size[k]
                })
            })
            .collect();
        let (mass, first, second) = moments(&own, &masses.nodal);
        // Coordinates near 5 have errors of 1e-15, 1e-14 of the smallest size.
        assert!((mass / exact_mass - 1.0).abs() < 1e-13, "{kind:?}");
        for k in 0..D {
            assert!(
                first[k].abs() < 1e-12 * exact_mass * size[k],
                "{kind:?}: {first:?}"
            );
        }
        let exact = |k: usize| exact_mass * size[k] * size[k] / 12.0;
        if D == 2 {
            let polar = second[0][0] + second[1][1];
            assert!(
                (polar / (exact(0) + exact(1)) - 1.0).abs() < 1e-12,
                "{kind:?}"
            );
        } else {
            // The rotation back leaves 1e-15 of the length in a hundredth of it.
            for k in 0..3 {
                assert!(
                    (second[k][k] / exact(k) - 1.0).abs() < 1e-11,
                    "{kind:?} {k}"
                );
                let l = (k + 1) % 3;
                let product = second[k][l] / (exact(k) * exact(l)).sqrt();
                assert!(product.abs() < 1e-11, "{kind:?}: {product}");
            }
        }
    }
}

#[test]
fn fitted_masses_have_exact_mass_centre_and_inertia() {
    fitted_box_is_exact([3.0, 1.0], [6, 3]);
    fitted_box_is_exact([3.0, 1.0, 2.0], [5, 4, 4]);
    // Slender and oblique: 1 : 100.
    fitted_box_is_exact([10.0, 0.1], [40, 4]);
    fitted_box_is_exact([10.0, 0.1, 8.0], [5, 4, 4]);
}

#[test]
fn the_factor_of_the_bar_is_gentle() {
    let bar = box_mesh([10.0, 1.0], [40, 4], ElementKind::Quad4, 0.0);
    let masses = made(&bar, Mass::Auto);
    let low = masses.factor.iter().copied().fold(f64::INFINITY, f64::min);
    let high = masses.factor.iter().copied().fold(0.0, f64::max);
    // The figures of the design study, to their last digit.
    assert!((low - 0.994).abs() < 5e-4, "{low}");
    assert!((high - 1.003).abs() < 5e-4, "{high}");
}

#[test]
fn one_layer_keeps_mass_and_centre_and_says_what_it_misses() {
    let plate = box_mesh([8.0, 8.0, 0.5], [8, 8, 1], ElementKind::Hex8, 0.7);
    let lumped = made(&plate, Mass::Lumped);
    let masses = made(&plate, Mass::Auto);
    assert_eq!(masses.kind, [MassKind::Fitted]);
    // ∫z² is 3 times too large: 2 · 0.5²/12 over (8² + 0.5²)/12.
    let missed = 2.0 * 0.25 / 64.25;
    assert!(
        (masses.inertia_error[0] / missed - 1.0).abs() < 1e-10,
        "{:?}",
        masses.inertia_error
    );
    assert!(masses.inertia_error[0] < lumped.inertia_error[0]);
    let (mass, first, _) = moments(&plate.nodes, &masses.nodal);
    let (exact_mass, exact_first, _) = moments(&plate.nodes, &lumped.nodal);
    assert!((mass / exact_mass - 1.0).abs() < 1e-13);
    for (a, b) in first.iter().zip(exact_first) {
        assert!((a - b).abs() < 1e-12 * exact_mass * 8.0);
    }
}

/// Nodes of a file of single precision are never quite in a plane.
#[test]
fn a_layer_that_is_not_quite_flat_is_fitted_like_a_flat_one() {
    let flat = box_mesh([8.0, 8.0, 0.5], [8, 8, 1], ElementKind::Hex8, 0.0);
    let expected = made(&flat, Mass::Auto);
    for roughness in [1e-9, 1e-6, 1e-4] {
        let mut random = fastrand::Rng::with_seed(4);
        let mut rough = flat.clone();
        for node in &mut rough.nodes {
            node[2] += roughness * (random.f64() - 0.5);
        }
        let masses = made(&rough, Mass::Auto);
        assert_eq!(masses.kind, [MassKind::Fitted], "{roughness}");
        let [flat, rough] = [&expected, &masses].map(|masses| masses.inertia_error[0]);
        // The moments change by about as much as the places of the nodes.
        assert!(
            (rough - flat).abs() < roughness,
            "{roughness}: {rough} {flat}"
        );
    }
}

#[test]
fn a_thick_layer_of_very_many_nodes_reports_its_error() {
    let beam = |length: usize| {
        box_mesh(
            [2.0 * length as f64, 2.0, 2.0],
            [length, 1, 1],
            ElementKind::Hex8,
            0.0,
        )
    };
    let short = made(&beam(40), Mass::Auto);
    assert_eq!(
        (short.kind[0], short.inertia_error[0]),
        (MassKind::Consistent, 0.0)
    );
    // Too many nodes for a dense matrix, one element across: the error stays.
    let masses = made(&beam(300), Mass::Auto);
    assert_eq!(masses.kind, [MassKind::Fitted]);
    // About its axis: y² and z² are both 3 times too large.
    assert!(
        (masses.inertia_error[0] - 2.0).abs() < 1e-9,
        "{:?}",
        masses.inertia_error
    );
    assert!(masses.consistent.is_empty());
    assert!(
        masses
            .factor
            .iter()
            .all(|&factor| factor >= SMALLEST_FACTOR)
    );
}

#[test]
fn consistent_masses_are_the_assembled_matrix() {
    for kind in kinds::<3>() {
        let mesh = box_mesh([2.0, 1.0, 1.0], [2, 1, 1], kind, 0.3);
        let masses = made(&mesh, Mass::Consistent);
        let dense = &masses.consistent[0];
        let n = mesh.nodes.len();
        assert_eq!((dense.block, dense.first_node, dense.size), (0, 0, n));
        let matrix = nalgebra::DMatrix::from_row_slice(n, n, &dense.matrix);
        // Round-off of entries of some hundred kg.
        assert!((&matrix - matrix.transpose()).amax() < 1e-12, "{kind:?}");
        for a in 0..n {
            let row: f64 = matrix.row(a).sum();
            assert!((row / masses.nodal[a] - 1.0).abs() < 1e-13, "{kind:?}");
        }
        // Rotation about z: v = (−y, x), energy ½ J ω².
        let turning = |k: usize| nalgebra::DVector::from_fn(n, |a, _| mesh.nodes[a][k]);
        let energy: f64 = (0..3)
            .map(|k| turning(k).dot(&(&matrix * turning(k))))
            .sum();
        // ∫ρ r² of a box with a corner at the origin, in any orientation.
        let exact = 2500.0 * 2.0 * (4.0 + 1.0 + 1.0) / 3.0;
        assert!((energy / exact - 1.0).abs() < 1e-13, "{kind:?}");
    }
}

#[test]
fn frequencies_of_consistent_blocks_are_exact_or_bounded() {
    let mesh = box_mesh([2.0, 1.0, 1.0], [3, 2, 2], ElementKind::Tet4, 0.3);
    let sets = sets(&mesh);
    let dense = &made(&mesh, Mass::Consistent).consistent[0];
    assert!(dense.size <= 64);
    let exact = dense.frequency(&mesh, &sets);
    let bound = (0..sets[0].len())
        .map(|i| sets[0].consistent_frequency(i, &mesh))
        .fold(0.0, f64::max);
    assert!(exact <= bound && bound < 1.5 * exact, "{exact} {bound}");

    let larger = box_mesh([4.0, 2.0, 2.0], [6, 4, 4], ElementKind::Tet4, 0.3);
    let dense = &made(&larger, Mass::Consistent).consistent[0];
    assert!(dense.size > 64);
    let bounded = dense.frequency(&larger, &crate::element::mass::tests::sets(&larger));
    // Elements of the same size and shapes.
    assert!((bounded / bound - 1.0).abs() < 1e-9, "{bounded} {bound}");

    let lone = simplex(&[[0.1, 0.0], [3.0, 0.5], [1.0, 2.0]], ElementKind::Tri3);
    let lone_sets = crate::element::mass::tests::sets(&lone);
    let dense = &made(&lone, Mass::Auto).consistent[0];
    let ratio = dense.frequency(&lone, &lone_sets) / lone_sets[0].frequency(0, &[1.0; 3]);
    assert!((ratio - 2.0).abs() < 1e-12, "{ratio}");
}

#[test]
fn blocks_of_several_shapes_and_several_blocks_are_kept_apart() {
    // A square with a triangle on its right side; far from it a single triangle.
    let mesh = Mesh::<2> {
        nodes: vec![
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 2.0],
            [0.0, 2.0],
            [3.0, 1.0],
            [10.0, 0.0],
            [13.0, 0.0],
            [10.0, 3.0],
        ],
        elements: vec![
            Element::new(ElementKind::Tri3, &[1, 4, 2]),
            Element::new(ElementKind::Quad4, &[0, 1, 2, 3]),
            Element::new(ElementKind::Tri3, &[5, 6, 7]),
        ],
        blocks: vec![
            MeshBlock {
                name: "mixed".into(),
                source: 0,
                nodes: 0..5,
                elements: 0..2,
            },
            MeshBlock {
                name: "lone".into(),
                source: 1,
                nodes: 5..8,
                elements: 2..3,
            },
        ],
        ..Mesh::default()
    };
    let both = [Mass::Consistent, Mass::Lumped];
    let masses = build(&mesh, &sets(&mesh), &both).expect("both can be had");
    assert_eq!(masses.kind, [MassKind::Consistent, MassKind::Lumped]);
    assert_eq!(masses.consistent.len(), 1);
    let total = 2500.0 * 0.7;
    let sum: f64 = masses.consistent[0].matrix.iter().sum();
    assert!((sum / (total * 5.0) - 1.0).abs() < 1e-13);
    let lone: f64 = masses.nodal[5..].iter().sum();
    assert!((lone / (total * 4.5) - 1.0).abs() < 1e-13);
    assert!((masses.inertia_error[1] - 3.0).abs() < 1e-12);
}

#[test]
fn impossible_masses_name_block_and_cure() {
    // A tetrahedron cut into four at its centre: its corners may keep 4/15 of their masses, 1/20
    // instead of 3/16 of the whole. With 0.3 they correct 21/22 of the error.
    let mut star = simplex(
        &[[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]],
        ElementKind::Tet4,
    );
    star.nodes.push([1.0; 3]);
    star.elements = [[0, 1, 2, 4], [0, 3, 1, 4], [0, 2, 3, 4], [1, 3, 2, 4]]
        .map(|nodes| Element::new(ElementKind::Tet4, &nodes))
        .into();
    (star.blocks[0].nodes, star.blocks[0].elements) = (0..5, 0..4);
    let refused = masses(&star, Mass::Fitted).expect_err("corners too light");
    let MassFault::NoFit { corrected } = refused.fault else {
        panic!("{refused}");
    };
    // The search halves the interval ten times.
    assert!(
        (0.0..1.0 / 1024.0).contains(&(21.0 / 22.0 - corrected)),
        "{corrected}"
    );
    assert!(refused.to_string().contains("more elements"), "{refused}");
    assert_eq!(made(&star, Mass::Auto).kind, [MassKind::Consistent]);
    let cured = box_mesh([1.0; 3], [2; 3], ElementKind::Tet4, 0.0);
    assert_eq!(made(&cured, Mass::Fitted).kind, [MassKind::Fitted]);
    assert!(made(&cured, Mass::Fitted).inertia_error[0] < 1e-12);

    let large = box_mesh([1.0; 2], [40, 40], ElementKind::Tri3, 0.0);
    let refused = masses(&large, Mass::Consistent).expect_err("1681 nodes");
    assert_eq!(refused.fault, MassFault::TooManyNodes { nodes: 1681 });
    let message = refused.to_string();
    assert!(
        message.starts_with("block \"box\": ") && message.contains("\"fitted\""),
        "{message}"
    );

    let mut orphan = simplex(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], ElementKind::Tri3);
    orphan.nodes.push([5.0, 5.0]);
    orphan.blocks[0].nodes = 0..4;
    for mass in [Mass::Auto, Mass::Consistent, Mass::Lumped] {
        let error = masses(&orphan, mass).expect_err("a node without mass");
        assert_eq!((error.block, error.fault), (0, MassFault::NotPositive));
    }
}
