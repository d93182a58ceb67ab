//! Highest frequencies of elements, and their stable steps.

use nalgebra::DMatrix;

use crate::element::geometry::{ElementGeometry, NodalValues};
use crate::element::tensor::{Tensor, contraction, determinant, extreme_principal_values, trace};

/// Returns the stable step of central differences, s, for the angular frequency `omega` (rad/s)
/// with stiffness-proportional damping `beta` (s). The damping force is taken at the velocity
/// before the kick: (2/ω)(√(1+ξ²) − ξ) with ξ = βω/2.
#[must_use]
pub(crate) fn stable_step(omega: f64, beta: f64) -> f64 {
    let ratio = 0.5 * beta * omega;
    // √(1+ξ²) − ξ, without cancellation for large ξ.
    2.0 / (omega * (ratio.hypot(1.0) + ratio))
}

/// Returns the highest angular frequency of K x = ω² (M ⊗ I) x, rad/s.
///
/// `stiffness` is symmetric, N/m, the components of a node together; `mass` is the positive
/// definite mass matrix of `nodes` nodes, kg; both row by row. The result is infinite if `mass` is
/// not positive definite or an entry is not finite: then no step is stable.
///
/// # Panics
/// If the lengths do not fit `nodes`.
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

/// Returns the highest angular frequency of an element with nodal masses `mass`, rad/s.
pub(super) fn lumped<const D: usize, const N: usize, const Q: usize>(
    element: &ElementGeometry<D, N, Q>,
    mass: &[f64; N],
) -> f64 {
    if Q == 1 {
        return simplex(element, &element.gradients[0], mass);
    }
    let entry = |row: usize, column: usize| {
        element.stiffness(row, column) / (mass[row / D] * mass[column / D]).sqrt()
    };
    highest(DMatrix::from_fn(N * D, N * D, entry))
}

/// Returns the highest angular frequency of an element with its mass matrix, rad/s.
pub(super) fn consistent<const D: usize, const N: usize, const Q: usize>(
    element: &ElementGeometry<D, N, Q>,
    mass: &[[f64; N]; N],
) -> f64 {
    let entry = |at: usize| element.stiffness(at / (N * D), at % (N * D));
    let stiffness: Vec<f64> = (0..N * D * N * D).map(entry).collect();
    highest_frequency(&stiffness, mass.as_flattened(), N)
}

/// Returns the highest angular frequency of an element with one Gauss point, rad/s. M⁻¹Bᵀ(VC)B then
/// has the same non-zero eigenvalues as the map of strains ε to V·sym(σ(ε)·G), where G = Σ g⊗g/m
/// sums over the nodes with gradients g and masses m. In the principal axes of G the shear strains
/// are uncoupled, with eigenvalues V μ (Gᵢ + Gⱼ). The normal strains give D×D equations, V (2μ diag
/// G + λ √G √Gᵀ), whose invariants are those of G times constants. The largest root of their
/// characteristic polynomial is the largest eigenvalue unless λ < 0.
fn simplex<const D: usize, const N: usize, const Q: usize>(
    element: &ElementGeometry<D, N, Q>,
    gradients: &NodalValues<D, N>,
    mass: &[f64; N],
) -> f64 {
    let volume = element.volumes[0];
    let (lambda, mu) = (volume * element.lame.lambda, volume * element.lame.mu);
    let mut spread: Tensor<D> = [[0.0; D]; D];
    for (gradient, mass) in gradients.iter().zip(mass) {
        for i in 0..D {
            for j in 0..D {
                spread[i][j] += gradient[i] * gradient[j] / mass;
            }
        }
    }
    let square = trace(&spread).powi(2);
    let second = 0.5 * (square - contraction(&spread, &spread));
    let of_normals = [
        (lambda + 2.0 * mu) * trace(&spread),
        4.0 * mu * (lambda + mu) * second,
        4.0 * mu * mu * (3.0 * lambda + 2.0 * mu) * determinant(&spread),
    ];
    let largest = if D == 2 {
        let [sum, product, _] = of_normals;
        0.5 * (sum + (sum * sum - 4.0 * product).max(0.0).sqrt())
    } else {
        largest_root(of_normals)
    };
    let of_shear = || {
        let (low, high) = extreme_principal_values(&spread);
        mu * if D == 2 {
            low + high
        } else {
            trace(&spread) - low
        }
    };
    let largest = if lambda < 0.0 {
        largest.max(of_shear())
    } else {
        largest
    };
    if largest.is_finite() {
        largest.sqrt()
    } else {
        f64::INFINITY
    }
}

/// Returns the largest root of x³ − ax² + bx − c, whose roots are all real, after Viète.
fn largest_root([a, b, c]: [f64; 3]) -> f64 {
    let mean = a / 3.0;
    let radius = (mean * mean - b / 3.0).max(0.0).sqrt();
    if radius == 0.0 {
        return mean;
    }
    let cosine = (mean * (mean * mean - 0.5 * b) + 0.5 * c) / radius.powi(3);
    mean + 2.0 * radius * (cosine.clamp(-1.0, 1.0).acos() / 3.0).cos()
}

fn highest(matrix: DMatrix<f64>) -> f64 {
    if matrix.iter().all(|x| x.is_finite()) {
        matrix.symmetric_eigenvalues().max().sqrt()
    } else {
        f64::INFINITY
    }
}
