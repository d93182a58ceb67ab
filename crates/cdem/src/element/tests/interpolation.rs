//! Shape functions, quadrature and volumes.

use crate::element::shape::{QuadraturePoint, mass_rule, shape, stiffness_rule};
use crate::element::tests::*;

const ALL: [ElementKind; 5] = [
    ElementKind::Tri3,
    ElementKind::Quad4,
    ElementKind::Tet4,
    ElementKind::Wedge6,
    ElementKind::Hex8,
];

#[test]
fn shape_functions_sum_to_one_and_their_gradients_are_derivatives() {
    for kind in ALL {
        let at = [0.21, 0.34, if kind.dimension() == 3 { 0.13 } else { 0.0 }];
        let here = shape(kind, at);
        let sum: f64 = here.values.iter().sum();
        assert!((sum - 1.0).abs() < 1e-15, "{kind:?}");
        for k in 0..kind.dimension() {
            let step = 1e-5;
            let moved = |sign: f64| {
                let mut place = at;
                place[k] += sign * step;
                shape(kind, place).values
            };
            let (ahead, behind) = (moved(1.0), moved(-1.0));
            for a in 0..8 {
                let slope = (ahead[a] - behind[a]) / (2.0 * step);
                // Shape functions are at most linear in each coordinate.
                assert!(
                    (slope - here.gradients[a][k]).abs() < 1e-10,
                    "{kind:?} {a} {k}"
                );
            }
        }
    }
}

#[test]
fn every_shape_function_is_one_at_its_own_node() {
    let corners = |kind| -> Vec<[f64; 3]> {
        let triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let raised = |base: &[[f64; 2]], z: f64| -> Vec<[f64; 3]> {
            base.iter().map(|&[x, y]| [x, y, z]).collect()
        };
        match kind {
            ElementKind::Tri3 => raised(&triangle, 0.0),
            ElementKind::Quad4 => raised(&square, 0.0),
            ElementKind::Tet4 => [raised(&triangle, 0.0), vec![[0.0, 0.0, 1.0]]].concat(),
            ElementKind::Wedge6 => [raised(&triangle, -1.0), raised(&triangle, 1.0)].concat(),
            ElementKind::Hex8 => [raised(&square, -1.0), raised(&square, 1.0)].concat(),
        }
    };
    for kind in ALL {
        for (a, corner) in corners(kind).into_iter().enumerate() {
            for (b, value) in shape(kind, corner).values.into_iter().enumerate() {
                assert_eq!(value, if a == b { 1.0 } else { 0.0 }, "{kind:?} {a} {b}");
            }
        }
    }
}

/// Returns ∫ x^i y^j z^k over the reference element, in closed form.
fn monomial(kind: ElementKind, powers: [u32; 3]) -> f64 {
    let line = |p: u32| {
        if p.is_multiple_of(2) {
            2.0 / f64::from(p + 1)
        } else {
            0.0
        }
    };
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    let simplex = |p: &[u32]| {
        let top: f64 = p.iter().map(|&p| factorial(p)).product();
        top / factorial(p.iter().sum::<u32>() + p.len() as u32)
    };
    let [i, j, k] = powers;
    match kind {
        ElementKind::Tri3 => simplex(&[i, j]),
        ElementKind::Tet4 => simplex(&powers),
        ElementKind::Quad4 => line(i) * line(j),
        ElementKind::Hex8 => line(i) * line(j) * line(k),
        ElementKind::Wedge6 => simplex(&[i, j]) * line(k),
    }
}

#[test]
fn quadrature_is_as_exact_as_it_says() {
    // Largest total degree on the simplex part, and largest power of a coordinate of a square or
    // line, as needed for the masses of undistorted and distorted elements.
    let cases = [
        (ElementKind::Tri3, 2, 0, 1),
        (ElementKind::Tet4, 2, 0, 1),
        (ElementKind::Quad4, 0, 3, 3),
        (ElementKind::Wedge6, 3, 4, 2),
        (ElementKind::Hex8, 0, 4, 3),
    ];
    for (kind, simplex, line, stiffness) in cases {
        let dimension = kind.dimension();
        for powers in (0..125u32).map(|n| [n % 5, n / 5 % 5, n / 25]) {
            let fits = |simplex: u32, line: u32| match kind {
                ElementKind::Tri3 => powers[0] + powers[1] <= simplex && powers[2] == 0,
                ElementKind::Tet4 => powers.iter().sum::<u32>() <= simplex,
                ElementKind::Wedge6 => powers[0] + powers[1] <= simplex && powers[2] <= line,
                ElementKind::Quad4 | ElementKind::Hex8 => {
                    powers[..dimension].iter().all(|&p| p <= line)
                        && (dimension == 3 || powers[2] == 0)
                }
            };
            let exact = monomial(kind, powers);
            let integral = |rule: Vec<QuadraturePoint>| -> f64 {
                let at = |p: &QuadraturePoint| {
                    let x = p.position;
                    p.weight * (0..3).map(|k| x[k].powi(powers[k] as i32)).product::<f64>()
                };
                rule.iter().map(at).sum()
            };
            if fits(simplex, line) {
                let error = integral(mass_rule(kind)) - exact;
                assert!(error.abs() < 1e-14, "{kind:?} {powers:?}: {error}");
            }
            // Wedges: degree 2 across, 3 along.
            if fits(
                stiffness,
                if kind == ElementKind::Wedge6 {
                    3
                } else {
                    stiffness
                },
            ) {
                let error = integral(stiffness_rule(kind)) - exact;
                assert!(error.abs() < 1e-14, "{kind:?} {powers:?}: {error}");
            }
        }
    }
}

fn volumes_and_masses_of_a_box<const D: usize>() {
    for kind in kinds::<D>() {
        let size: [f64; D] = std::array::from_fn(|k| 1.5 + k as f64);
        let mut mesh = box_mesh(size, [2; D], kind, 0.4);
        // Far from the origin, and with a moved inner node: the sum must not change.
        let centre: [f64; D] = std::array::from_fn(|i| {
            (0..D)
                .map(|j| 0.5 * rotation::<D>(0.4)[i][j] * size[j])
                .sum()
        });
        let distance = |x: &[f64; D]| (0..D).map(|k| (x[k] - centre[k]).powi(2)).sum::<f64>();
        let inner = mesh
            .nodes
            .iter()
            .position(|x| distance(x) < 1e-12)
            .expect("a middle node");
        mesh.nodes[inner][0] += 0.2;
        mesh.nodes.iter_mut().for_each(|x| x[D - 1] += 100.0);

        let sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
        // Energy of a uniform stretch over its density is volume.
        let stretched = linear_field(&mesh, |i, j| if i + j == 0 { 0.1 } else { 0.0 });
        let strain = 0.1 + 0.5 * 0.1 * 0.1;
        let density = 0.5 * (rock().lame_lambda + 2.0 * rock().shear_modulus) * strain * strain;
        let (mut volume, mut lumped, mut consistent) = (0.0, 0.0, 0.0);
        for set in &sets {
            let nodes = kind.node_count();
            for i in 0..set.len() {
                let (mut row_sums, mut matrix) = ([0.0; 8], [0.0; 64]);
                set.lumped_mass(i, &mut row_sums);
                set.consistent_mass(i, &mesh, &mut matrix);
                for a in 0..nodes {
                    let row: f64 = matrix[a * nodes..][..nodes].iter().sum();
                    assert!(
                        (row / row_sums[a] - 1.0).abs() < 1e-13,
                        "{kind:?}: row sums"
                    );
                }
                volume += set.strain_energy(i, &stretched) / density;
                lumped += row_sums.iter().sum::<f64>();
                consistent += matrix.iter().sum::<f64>();
            }
        }
        let thickness = if D == 2 { THICKNESS } else { 1.0 };
        let exact = thickness * size.iter().product::<f64>();
        // Positions near 100 have errors of 1e-14 of the size.
        assert!(
            (volume / exact - 1.0).abs() < 1e-13,
            "{kind:?}: {volume} {exact}"
        );
        assert!((lumped / (2500.0 * exact) - 1.0).abs() < 1e-13, "{kind:?}");
        assert!(
            (consistent / (2500.0 * exact) - 1.0).abs() < 1e-13,
            "{kind:?}"
        );
    }
}

#[test]
fn volumes_and_masses_of_boxes_are_exact() {
    volumes_and_masses_of_a_box::<2>();
    volumes_and_masses_of_a_box::<3>();
}
