//! Patch tests: a linear displacement field gives uniform stress on any mesh.

use crate::element::tensor::{self, Tensor};
use crate::element::tests::*;

/// Returns the nodes that are not on the boundary.
fn inner_nodes<const D: usize>(mesh: &Mesh<D>) -> Vec<usize> {
    let mut on_boundary = vec![false; mesh.nodes.len()];
    for &facet in &*mesh.boundary_facets() {
        mesh.facet_nodes(facet)
            .for_each(|n| on_boundary[n as usize] = true);
    }
    (0..mesh.nodes.len()).filter(|&a| !on_boundary[a]).collect()
}

/// Returns the Cauchy stress of St Venant–Kirchhoff under F = I + H, in output order.
fn exact_stress<const D: usize>(h: &Tensor<D>, plane: Plane) -> [f64; 6] {
    let f = tensor::with_unit(h);
    let green: Tensor<D> = {
        let c = tensor::transposed_product(&f, &f);
        std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (c[i][j] - f64::from(i == j))))
    };
    let (mu, trace) = (rock().shear_modulus, tensor::trace(&green));
    let lambda = if D == 2 {
        rock().in_plane_lambda(plane)
    } else {
        rock().lame_lambda
    };
    let second_piola: Tensor<D> = std::array::from_fn(|i| {
        std::array::from_fn(|j| 2.0 * mu * green[i][j] + if i == j { lambda * trace } else { 0.0 })
    });
    let push = tensor::product_transposed(&tensor::product(&f, &second_piola), &f);
    let s = push.map(|row| row.map(|x| x / tensor::determinant(&f)));
    if D == 3 {
        return [s[0][0], s[1][1], s[2][2], s[0][1], s[1][2], s[2][0]];
    }
    let across = match plane {
        Plane::Strain => rock().lame_lambda * trace / tensor::determinant(&f),
        Plane::Stress => 0.0,
    };
    [s[0][0], s[1][1], across, s[0][1], 0.0, 0.0]
}

fn assert_uniform<const D: usize>(
    sets: &Sets<D>,
    displacement: &[[f64; D]],
    exact: [f64; 6],
    tolerance: f64,
) {
    let scale = exact.iter().fold(0.0f64, |m, x| x.abs().max(m));
    for (number, set) in sets.iter().enumerate() {
        for (i, stress) in stresses(&**set, displacement).into_iter().enumerate() {
            for (s, e) in stress.into_iter().zip(exact) {
                let error = (s - e).abs() / scale;
                assert!(error < tolerance, "set {number}, element {i}: {s} {e}");
            }
        }
    }
}

fn assert_inner_nodes_in_balance<const D: usize>(mesh: &Mesh<D>, force: &[[f64; D]]) {
    let inner = inner_nodes(mesh);
    assert!(!inner.is_empty());
    for a in inner {
        // Round-off of a few dozen forces.
        assert!(
            largest(&[force[a]]) < 1e-13 * largest(force),
            "node {a}: {:?}",
            force[a]
        );
    }
}

fn gradient<const D: usize>(size: f64) -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| size * noise(i + 3, j)))
}

fn total_passes_at_large_strain<const D: usize>(divisions: [usize; D]) {
    for kind in kinds::<D>() {
        for plane in PLANES {
            let mesh = distorted(divisions, kind, 0.15);
            let mut sets = sets_of(&mesh, rock(), Kinematics::Total, plane);
            let h = gradient::<D>(0.1);
            let displacement = linear_field(&mesh, |i, j| h[i][j]);
            assert_uniform(&sets, &displacement, exact_stress(&h, plane), 1e-13);
            assert_inner_nodes_in_balance(&mesh, &forces(&mut sets, &displacement));
        }
    }
}

#[test]
fn total_kinematics_pass_at_large_strain() {
    total_passes_at_large_strain([3, 3]);
    total_passes_at_large_strain([2, 2, 2]);
}

/// Tiny strains keep their digits on a block far from its rest position.
fn total_keeps_digits_at_small_strain<const D: usize>(divisions: [usize; D]) {
    for kind in kinds::<D>() {
        let mesh = distorted(divisions, kind, 0.15);
        let mut sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
        let h = gradient::<D>(1e-8);
        let exact = exact_small_stress(&h);
        let near = linear_field(&mesh, |i, j| h[i][j]);
        // E differs from the small strain by the displacement gradient, 1e-8.
        assert_uniform(&sets, &near, exact, 1e-7);
        // A shift of 1000 m leaves displacements with 1e-13 m: 1e-5 of 1e-8.
        let far: Vec<_> = near.iter().map(|u| u.map(|x| x + 1000.0)).collect();
        assert_uniform(&sets, &far, exact, 1e-4);
        // A pure shift causes no strain at all.
        let shift = vec![[1234.567; D]; mesh.nodes.len()];
        assert_eq!(largest(&forces(&mut sets, &shift)), 0.0);
    }
}

/// Returns C : sym H in plane strain or 3-D.
fn exact_small_stress<const D: usize>(h: &Tensor<D>) -> [f64; 6] {
    let (lambda, mu) = (rock().lame_lambda, rock().shear_modulus);
    let pressure = lambda * tensor::trace(h);
    let s = |i: usize, j: usize| mu * (h[i][j] + h[j][i]) + if i == j { pressure } else { 0.0 };
    if D == 2 {
        [s(0, 0), s(1, 1), pressure, s(0, 1), 0.0, 0.0]
    } else {
        [s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(2, 0)]
    }
}

#[test]
fn total_kinematics_keep_their_digits() {
    total_keeps_digits_at_small_strain([3, 3]);
    total_keeps_digits_at_small_strain([2, 2, 2]);
}

/// In many small steps the incremental stress of a pure stretch is that of logarithmic strain on
/// any mesh.
fn incremental_follows_a_stretch<const D: usize>(divisions: [usize; D]) {
    for kind in kinds::<D>() {
        for plane in PLANES {
            let mesh = distorted(divisions, kind, 0.15);
            let mut sets = sets_of(&mesh, rock(), Kinematics::Incremental, plane);
            let stretch = |t: f64| {
                linear_field(&mesh, |i, j| {
                    if i == j {
                        t * [0.02, -0.01, 0.015][i]
                    } else {
                        0.0
                    }
                })
            };
            let steps = 20;
            let mut force = Vec::new();
            for n in 1..=steps {
                force = advance(&mut sets, &stretch(f64::from(n) / f64::from(steps)));
            }
            let log = |i: usize| [0.02f64, -0.01, 0.015][i].ln_1p();
            let lambda = if D == 2 {
                rock().in_plane_lambda(plane)
            } else {
                rock().lame_lambda
            };
            let volume: f64 = (0..D).map(log).sum();
            let normal = |i: usize| 2.0 * rock().shear_modulus * log(i) + lambda * volume;
            let across = match (D, plane) {
                (3, _) => normal(2),
                (_, Plane::Strain) => lambda * volume,
                (_, Plane::Stress) => 0.0,
            };
            let exact = [normal(0), normal(1), across, 0.0, 0.0, 0.0];
            // The mid-step increment has an error of (strain per step)²/12: 1e-3² / 12.
            assert_uniform(&sets, &stretch(1.0), exact, 1e-6);
            assert_inner_nodes_in_balance(&mesh, &force);
        }
    }
}

#[test]
fn incremental_kinematics_give_logarithmic_strain() {
    incremental_follows_a_stretch([3, 3]);
    incremental_follows_a_stretch([2, 2, 2]);
}

fn formulations_agree_at_small_strain<const D: usize>(divisions: [usize; D]) {
    for kind in kinds::<D>() {
        let mesh = distorted(divisions, kind, 0.15);
        let mut sets = sets_of(&mesh, rock(), Kinematics::Incremental, Plane::Strain);
        let h = gradient::<D>(1e-7);
        for t in [0.25, 0.5, 1.0] {
            advance(&mut sets, &linear_field(&mesh, |i, j| t * h[i][j]));
        }
        let displacement = linear_field(&mesh, |i, j| h[i][j]);
        // They differ by about the strain, 1e-7 of the stress.
        assert_uniform(&sets, &displacement, exact_small_stress(&h), 1e-6);
        let total = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
        let (one, other) = (energy(&sets, &displacement), energy(&total, &displacement));
        assert!((one / other - 1.0).abs() < 1e-6, "{kind:?}: {one} {other}");
    }
}

#[test]
fn both_formulations_agree_at_small_strain() {
    formulations_agree_at_small_strain([3, 3]);
    formulations_agree_at_small_strain([2, 2, 2]);
}
