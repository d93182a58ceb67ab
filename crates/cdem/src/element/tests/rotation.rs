//! Rigid rotations of stressed blocks.

use crate::element::tensor::{self, Tensor};
use crate::element::tests::*;

/// Returns the displacement of a stretched body rotated by `angle`: u = (R F − I) X.
fn rotated<const D: usize>(mesh: &Mesh<D>, angle: f64) -> Vec<[f64; D]> {
    let stretch: Tensor<D> =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j) + 0.01 * noise(i, j)));
    let f = tensor::product(&rotation::<D>(angle), &stretch);
    linear_field(mesh, |i, j| f[i][j] - f64::from(i == j))
}

fn full<const D: usize>(voigt: [f64; 6]) -> Tensor<D> {
    let places = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];
    std::array::from_fn(|i| std::array::from_fn(|j| voigt[places[i][j]]))
}

/// Returns the largest error of stresses that should be R σ Rᵀ, relative to σ. In 2-D the component
/// across the plane must not change.
fn stress_error<const D: usize>(sets: &Sets<D>, mesh: &Mesh<D>, old: [f64; 6], angle: f64) -> f64 {
    let turn = rotation::<D>(angle);
    let expected = tensor::product_transposed(&tensor::product(&turn, &full(old)), &turn);
    let scale = largest(&full::<D>(old));
    let displacement = rotated(mesh, angle);
    let mut error = 0.0f64;
    for set in sets {
        for now in stresses(&**set, &displacement) {
            for (row, other) in full::<D>(now).iter().zip(&expected) {
                for (a, b) in row.iter().zip(other) {
                    error = error.max((a - b).abs() / scale);
                }
            }
            if D == 2 {
                error = error.max((now[2] - old[2]).abs() / scale);
            }
        }
    }
    error
}

fn total_is_objective<const D: usize>() {
    for kind in kinds::<D>() {
        let mesh = distorted([2; D], kind, 0.1);
        let sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
        let still = rotated(&mesh, 0.0);
        let stress = stresses(&*sets[0], &still)[0];
        for angle in [1e-3, 0.7, 2.5] {
            // Strain 1e-2 of displacements of size 4 has an error of some 1e-13.
            let error = stress_error(&sets, &mesh, stress, angle);
            assert!(error < 1e-12, "{kind:?} {angle}: {error}");
            let change = energy(&sets, &rotated(&mesh, angle)) / energy(&sets, &still) - 1.0;
            assert!(change.abs() < 1e-12, "{kind:?} {angle}: {change}");
        }
    }
}

#[test]
fn total_kinematics_turn_stress_to_round_off() {
    total_is_objective::<2>();
    total_is_objective::<3>();
}

/// About its own middle configuration a rigid increment is skew, and the formula of Hughes and
/// Winget gives the exact rotation. Nothing is lost even in large steps.
fn incremental_is_objective<const D: usize>() {
    for kind in kinds::<D>() {
        let mesh = distorted([2; D], kind, 0.1);
        let mut sets = sets_of(&mesh, rock(), Kinematics::Incremental, Plane::Strain);
        let still = rotated(&mesh, 0.0);
        advance(&mut sets, &still);
        let stress = stresses(&*sets[0], &still)[0];
        let before = energy(&sets, &still);
        for angle in [0.01, 0.5, 1.4, 2.5] {
            advance(&mut sets, &rotated(&mesh, angle));
            let error = stress_error(&sets, &mesh, stress, angle);
            // Increments of size 1 bring errors of 1e-16 into strains of 1e-2.
            assert!(error < 1e-12, "{kind:?} {angle}: {error}");
            let change = energy(&sets, &rotated(&mesh, angle)) / before - 1.0;
            // A stress σ with such an error does work along paths of up to 2. It is compared with
            // the energy ½ σ ε at a strain ε of 1e-2.
            assert!(
                change.abs() <= 400.0 * error.max(f64::EPSILON),
                "{kind:?} {angle}: {change}"
            );
        }
    }
}

#[test]
fn incremental_kinematics_turn_stress_to_round_off() {
    incremental_is_objective::<2>();
    incremental_is_objective::<3>();
}

/// Returns the error of the stress after F(t) = R(t) U(t), with U along fixed axes of the material:
/// the exact stress is R (C : log U) Rᵀ.
fn stretched_while_turning<const D: usize>(kind: ElementKind, steps: u32) -> f64 {
    let mesh = distorted([2; D], kind, 0.1);
    let mut sets = sets_of(&mesh, rock(), Kinematics::Incremental, Plane::Strain);
    let stretch = |t: f64, i: usize| 1.0 + t * [0.05, -0.03, 0.02][i];
    let displacement = |t: f64| {
        let turn = rotation::<D>(t);
        linear_field(&mesh, |i, j| turn[i][j] * stretch(t, j) - f64::from(i == j))
    };
    for n in 1..=steps {
        advance(&mut sets, &displacement(f64::from(n) / f64::from(steps)));
    }
    let log = |i: usize| stretch(1.0, i).ln();
    let pressure = rock().lame_lambda * (0..D).map(log).sum::<f64>();
    let normal = |i: usize| 2.0 * rock().shear_modulus * log(i) + pressure;
    let along: Tensor<D> =
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { normal(i) } else { 0.0 }));
    let turn = rotation::<D>(1.0);
    let exact = tensor::product_transposed(&tensor::product(&turn, &along), &turn);
    let found = full::<D>(stresses(&*sets[0], &displacement(1.0))[0]);
    let differences = found
        .iter()
        .flatten()
        .zip(exact.iter().flatten())
        .map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / largest(&exact)
}

fn incremental_errs_by_the_square_of_the_step<const D: usize>() {
    for kind in kinds::<D>() {
        let (coarse, fine) = (
            stretched_while_turning::<D>(kind, 10),
            stretched_while_turning::<D>(kind, 20),
        );
        // Strains have an error of tan²½Δθ, 0.1² / 4.
        assert!(coarse < 3e-3, "{kind:?}: {coarse}");
        let order = (coarse / fine).log2();
        assert!((1.9..2.1).contains(&order), "{kind:?}: order {order}");
    }
}

#[test]
fn incremental_kinematics_are_of_second_order() {
    incremental_errs_by_the_square_of_the_step::<2>();
    incremental_errs_by_the_square_of_the_step::<3>();
}

#[test]
fn a_stress_free_body_turns_without_stress() {
    // R − I is skew about the mid-step configuration, so even one step of 1 rad causes no strain.
    let mesh = distorted([2, 2, 2], ElementKind::Hex8, 0.1);
    let mut sets = sets_of(&mesh, rock(), Kinematics::Incremental, Plane::Strain);
    let turn = rotation::<3>(1.0);
    let displacement = linear_field(&mesh, |i, j| turn[i][j] - f64::from(i == j));
    advance(&mut sets, &displacement);
    for component in stresses(&*sets[0], &displacement)[3] {
        // Round-off of the unit in strain, times moduli of 1e9.
        assert!(component.abs() < 1e-14 * 1e10, "{component}");
    }
}

#[test]
fn rotations_are_proper() {
    let turn = rotation::<3>(0.7);
    let unit = tensor::product_transposed(&turn, &turn);
    for (i, row) in unit.iter().enumerate() {
        for (j, x) in row.iter().enumerate() {
            assert!((x - f64::from(i == j)).abs() < 1e-15);
        }
    }
    assert!((tensor::determinant(&turn) - 1.0).abs() < 1e-15);
    assert!((tensor::trace(&turn) - (1.0 + 2.0 * 0.7f64.cos())).abs() < 1e-15);
}
