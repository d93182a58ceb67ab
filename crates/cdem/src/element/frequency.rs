//! Highest frequencies of elements, and the time steps they allow.

use nalgebra::{DMatrix, Matrix6, Vector6};

use super::geometry::{Element, Nodal};

/// Longest stable step of central differences, s, for the angular frequency
/// `omega` (rad/s) with stiffness-proportional damping `beta` (s), the
/// damping force taken at the velocity before the kick:
/// (2/ω)(√(1+ξ²) − ξ) with ξ = βω/2.
#[must_use]
pub(crate) fn stable_step(omega: f64, beta: f64) -> f64 {
    let ratio = 0.5 * beta * omega;
    // √(1+ξ²) − ξ, without cancellation for large ξ.
    2.0 / (omega * (ratio.hypot(1.0) + ratio))
}

/// Highest angular frequency of K x = ω² (M ⊗ I) x, rad/s.
///
/// `stiffness` is symmetric, N/m, the components of a node together; `mass`
/// is the positive definite mass matrix of `nodes` nodes, kg; both row by
/// row. Infinite when `mass` is not positive definite or an entry not finite:
/// no step is stable then.
///
/// # Panics
/// When the lengths do not fit `nodes`.
#[must_use]
pub(crate) fn highest_frequency(stiffness: &[f64], mass: &[f64], nodes: usize) -> f64 {
    let dimension = stiffness.len().isqrt() / nodes;
    let size = nodes * dimension;
    let stiffness = DMatrix::from_row_slice(size, size, stiffness);
    let mass = DMatrix::from_row_slice(nodes, nodes, mass)
        .kronecker(&DMatrix::<f64>::identity(dimension, dimension));
    let reduced = mass.cholesky().and_then(|cholesky| {
        let lower = cholesky.l();
        let half = lower.solve_lower_triangular(&stiffness)?;
        lower.solve_lower_triangular(&half.transpose())
    });
    reduced.map_or(f64::INFINITY, highest)
}

/// Highest angular frequency of an element with nodal masses `mass`, rad/s.
pub(super) fn lumped<const D: usize, const N: usize, const Q: usize>(
    element: &Element<D, N, Q>,
    mass: &[f64; N],
) -> f64 {
    if Q == 1 {
        return simplex(element, &element.gradients[0], mass);
    }
    let entry = |row: usize, column: usize| {
        let (a, b) = (row / D, column / D);
        element.stiffness((a, row % D), (b, column % D)) / (mass[a] * mass[b]).sqrt()
    };
    highest(DMatrix::from_fn(N * D, N * D, entry))
}

/// Highest angular frequency of an element with its mass matrix, rad/s.
pub(super) fn consistent<const D: usize, const N: usize, const Q: usize>(
    element: &Element<D, N, Q>,
    mass: &[[f64; N]; N],
) -> f64 {
    let entry = |at: usize| {
        let (row, column) = (at / (N * D), at % (N * D));
        element.stiffness((row / D, row % D), (column / D, column % D))
    };
    let stiffness: Vec<f64> = (0..N * D * N * D).map(entry).collect();
    highest_frequency(&stiffness, mass.as_flattened(), N)
}

/// With one Gauss point M⁻¹Bᵀ(VC)B has the same non-zero eigenvalues as
/// V C^½ B M⁻¹ Bᵀ C^½, of the size of a strain: 3 in 2-D, 6 in 3-D.
///
/// In the orthonormal (Mandel) basis C = λ 1⊗1 + 2μ I, whose root is
/// √(2μ) (I + k 1⊗1) with 1 + kD = √((Dλ + 2μ)/2μ).
fn simplex<const D: usize, const N: usize, const Q: usize>(
    element: &Element<D, N, Q>,
    gradients: &Nodal<D, N>,
    mass: &[f64; N],
) -> f64 {
    let (lambda, mu) = (element.lame.lambda, element.lame.mu);
    let k = ((0.5 * D as f64 * lambda / mu + 1.0).sqrt() - 1.0) / D as f64;
    let scale = 2.0 * mu * element.volumes[0];
    let mut matrix = Matrix6::zeros();
    for (gradient, mass) in gradients.iter().zip(mass) {
        for i in 0..D {
            let mut strain = Vector6::zeros();
            for j in 0..D {
                if i == j {
                    strain[i] += gradient[i];
                } else {
                    // Place of the shear of the plane that i and j span.
                    let shear = if D == 2 { 2 } else { i + j + 2 };
                    strain[shear] = gradient[j] * std::f64::consts::FRAC_1_SQRT_2;
                }
                strain[j] += k * gradient[i];
            }
            matrix += strain * strain.transpose() * (scale / mass);
        }
    }
    if matrix.iter().all(|x| x.is_finite()) {
        matrix.symmetric_eigenvalues().max().sqrt()
    } else {
        f64::INFINITY
    }
}

fn highest(matrix: DMatrix<f64>) -> f64 {
    if matrix.iter().all(|x| x.is_finite()) {
        matrix.symmetric_eigenvalues().max().sqrt()
    } else {
        f64::INFINITY
    }
}
