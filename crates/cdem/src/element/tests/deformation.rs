//! Detection of inverted and overstretched elements.

use crate::element::tensor;
use crate::element::tests::*;
use proptest::prelude::*;

fn stretches_of_a_turned_box<const D: usize>() {
    let stretches = [0.9, 1.3, 1.05];
    for kind in kinds::<D>() {
        let mesh = distorted([2; D], kind, 0.1);
        let sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
        let turn = rotation::<D>(0.8);
        let displacement =
            linear_field(&mesh, |i, j| turn[i][j] * stretches[j] - f64::from(i == j));
        let found = sets[0].deformation(0, &displacement);
        let volume: f64 = stretches[..D].iter().product();
        // The principal values of a 3×3 tensor have half the digits at worst.
        assert!((found.min_jacobian - volume).abs() < 1e-13, "{kind:?}");
        assert!(
            (found.min_stretch - 0.9).abs() < 1e-8,
            "{kind:?}: {found:?}"
        );
        assert!(
            (found.max_stretch - 1.3).abs() < 1e-8,
            "{kind:?}: {found:?}"
        );
    }
}

#[test]
fn stretches_are_those_of_the_motion() {
    stretches_of_a_turned_box::<2>();
    stretches_of_a_turned_box::<3>();
}

/// Returns the elements that are strained by more than `most`.
fn strained<const D: usize>(sets: &Sets<D>, displacement: &[[f64; D]], most: f64) -> Vec<u32> {
    sets[0].strained(displacement, most)
}

fn a_mirrored_body_is_inverted<const D: usize>() {
    for kind in kinds::<D>() {
        let mesh = one_element::<D>(kind);
        let sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
        let mirror = linear_field(&mesh, |i, j| if i == 0 && j == 0 { -2.0 } else { 0.0 });
        let found = sets[0].deformation(0, &mirror);
        assert!(
            (found.min_jacobian + 1.0).abs() < 1e-14,
            "{kind:?}: {found:?}"
        );
        assert_eq!(strained(&sets, &mirror, 0.1), [0], "{kind:?}");
        let rest = sets[0].deformation(0, &vec![[0.0; D]; mesh.nodes.len()]);
        assert_eq!(
            (rest.min_jacobian, rest.min_stretch, rest.max_stretch),
            (1.0, 1.0, 1.0)
        );
    }
}

#[test]
fn inversion_is_seen() {
    a_mirrored_body_is_inverted::<2>();
    a_mirrored_body_is_inverted::<3>();
}

/// Elements rotated by π, with random strains around a bound: elements within the bound have
/// stretches within the matching bound.
fn strain_bounds_stretches<const D: usize>() {
    let half_turn = rotation::<D>(std::f64::consts::PI);
    for kind in kinds::<D>() {
        let mesh = distorted::<D>([3; D], kind, 0.1);
        let sets = sets_of(&mesh, rock(), Kinematics::Total, Plane::Strain);
        // Strains of all Gauss points count together; a simplex has one.
        let nodes = kind.node_count();
        let points = if nodes == D + 1 { 1 } else { nodes };
        let amplitude = 0.06 / (points as f64).sqrt();
        let turn = |i: usize, j: usize| half_turn[i][j] - f64::from(u8::from(i == j));
        let mut displacement = linear_field(&mesh, turn);
        for (a, moved) in displacement.iter_mut().enumerate() {
            (0..D).for_each(|k| moved[k] += amplitude * noise(a, k));
        }
        let (most, mut within) = (0.1, 0);
        let strained = strained(&sets, &displacement, most);
        for i in 0..sets[0].len() {
            let found = sets[0].deformation(i, &displacement);
            if !strained.contains(&(i as u32)) {
                within += 1;
                assert!(
                    found.min_stretch >= (1.0 - 2.0 * most).sqrt(),
                    "{kind:?} {found:?}"
                );
                assert!(
                    found.max_stretch <= (1.0 + 2.0 * most).sqrt(),
                    "{kind:?} {found:?}"
                );
            }
        }
        assert!((1..sets[0].len()).contains(&within), "{kind:?}: {within}");
    }
}

#[test]
fn strain_within_a_bound_keeps_stretches_within_theirs() {
    strain_bounds_stretches::<2>();
    strain_bounds_stretches::<3>();
}

proptest! {
    #[test]
    fn principal_values_are_eigenvalues(entries in prop::array::uniform6(-3.0f64..3.0)) {
        let [a, b, c, d, e, f] = entries;
        let three = [[a, d, f], [d, b, e], [f, e, c]];
        let (low, high) = tensor::extreme_principal_values(&three);
        let eigen = nalgebra::Matrix3::from(three).symmetric_eigenvalues();
        // The closed form loses up to half of the digits near double roots.
        prop_assert!((low - eigen.min()).abs() < 1e-7);
        prop_assert!((high - eigen.max()).abs() < 1e-7);
        let two = [[a, d], [d, b]];
        let (low, high) = tensor::extreme_principal_values(&two);
        let eigen = nalgebra::Matrix2::from(two).symmetric_eigenvalues();
        prop_assert!((low - eigen.min()).abs() < 1e-13);
        prop_assert!((high - eigen.max()).abs() < 1e-13);
    }

    #[test]
    fn inverses_invert(entries in prop::array::uniform9(-1.0f64..1.0)) {
        let mut matrix = [[0.0; 3]; 3];
        matrix.as_flattened_mut().copy_from_slice(&entries);
        // Diagonally dominant: far from singular.
        (0..3).for_each(|i| matrix[i][i] += 4.0);
        let (inverse, determinant) = tensor::inverse(&matrix);
        prop_assert!((determinant - tensor::determinant(&matrix)).abs() < 1e-13 * determinant);
        let unit = tensor::product(&inverse, &matrix);
        for (i, row) in unit.iter().enumerate() {
            for (j, x) in row.iter().enumerate() {
                prop_assert!((x - f64::from(i == j)).abs() < 1e-13);
            }
        }
    }
}
