//! Nodal masses fitted to the exact mass, centre and inertia of a block.

use nalgebra::{DMatrix, DVector};

use crate::element::mass::SMALLEST_FACTOR;
use crate::element::mass::inertia::SecondMoments;
use crate::element::mass::least_change::LeastChange;

/// Eigenvalue of the fit below which the nodes cannot represent a moment. There a quadratic
/// function is linear on the nodes up to round-off.
const RANK_TOLERANCE: f64 = 1e-10;

/// Largest change of the factors in the mass-weighted mean square that a moment may need. A larger
/// one would give some nodes ten times their mass: such nodes, as of a layer that is not quite
/// flat, do not represent the moment.
const LARGEST_CHANGE: f64 = 3.0;

/// Halvings of the interval of the corrected fraction (count).
const FRACTION_HALVINGS: usize = 10;

/// Factors on lumped masses: the [least change](LeastChange) with the exact moments.
///
/// 2-D: mass, centre and polar moment are exact; 3-D: all ten moments up to the second. Where the
/// bound is not reached, the factors are 1 + q(X_a) with a quadratic polynomial q. Moments that the
/// nodes cannot represent, as through one layer of elements, are left out in the least-squares
/// sense; mass and centre stay exact. If no masses above the bound have the others, the factors
/// correct the largest possible fraction of the errors.
pub(super) struct MassFit {
    /// Factor of each node; each at least [`SMALLEST_FACTOR`].
    pub(super) factors: Vec<f64>,
    /// Corrected fraction of those errors of the lumped masses that the nodes can represent.
    pub(super) corrected: f64,
}

impl MassFit {
    /// Computes the fit for nodes at `rest` with the masses `lumped`, kg.
    pub(super) fn new<const D: usize>(
        inertia: &SecondMoments<D>,
        rest: &[[f64; D]],
        lumped: &[f64],
    ) -> Self {
        let system = FitEquations::new(inertia, rest, lumped);
        let fit = |corrected: f64| {
            let factors = system.factors(corrected)?;
            Some(Self { factors, corrected })
        };
        fit(1.0).unwrap_or_else(|| {
            let (mut reached, mut above) = (0.0, 1.0);
            let mut best = None;
            for _ in 0..FRACTION_HALVINGS {
                let corrected = 0.5 * (reached + above);
                if let Some(found) = fit(corrected) {
                    (reached, best) = (corrected, Some(found));
                } else {
                    above = corrected;
                }
            }
            best.unwrap_or_else(|| Self {
                factors: vec![1.0; lumped.len()],
                corrected: 0.0,
            })
        })
    }
}

/// The equations of a fit: moments of linear functions, and of quadratic functions orthogonal to
/// them. The lumped masses have the exact mass and centre, and so lack only the second kind.
struct FitEquations {
    /// The functions (columns) at the nodes (rows).
    functions: DMatrix<f64>,
    /// Masses of the nodes over that of the block.
    masses: Vec<f64>,
    /// Moments of the lumped masses.
    lumped: DVector<f64>,
    /// Moments that they lack, as far as the nodes can represent them.
    missing: DVector<f64>,
}

impl FitEquations {
    fn new<const D: usize>(inertia: &SecondMoments<D>, rest: &[[f64; D]], lumped: &[f64]) -> Self {
        let local: Vec<[f64; D]> = rest.iter().map(|point| inertia.local(point)).collect();
        let masses: Vec<f64> = lumped.iter().map(|mass| mass / inertia.mass()).collect();
        let weighted = |functions: &DMatrix<f64>| {
            DMatrix::from_fn(functions.nrows(), functions.ncols(), |a, f| {
                masses[a] * functions[(a, f)]
            })
        };
        let linear = DMatrix::from_fn(rest.len(), D + 1, |a, k| {
            if k == 0 { 1.0 } else { local[a][k - 1] }
        });
        let products = QUADRATICS[D - 2];
        let mut quadratic = DMatrix::from_fn(rest.len(), products.len(), |a, f| {
            let terms = products[f].iter();
            terms.map(|&(k, l)| local[a][k] * local[a][l]).sum::<f64>()
        });
        let exact = |&(k, l): &(usize, usize)| inertia.second(k, l);
        let mut missing = DVector::from_fn(products.len(), |f, _| {
            products[f].iter().map(exact).sum::<f64>()
        });
        let of_linear = weighted(&linear);
        if let Some(cholesky) = linear.tr_mul(&of_linear).cholesky() {
            // The second pass removes the round-off of the first.
            for _ in 0..2 {
                let part = cholesky.solve(&of_linear.tr_mul(&quadratic));
                quadratic -= &linear * &part;
                missing -= part.row(0).transpose();
            }
        } else {
            // Nodes in one plane have no moments to fit.
            quadratic.fill(0.0);
        }
        let represented = represented(quadratic.tr_mul(&weighted(&quadratic)), &missing);
        let count = D + 1 + products.len();
        let functions = DMatrix::from_fn(rest.len(), count, |a, f| {
            if f <= D {
                linear[(a, f)]
            } else {
                quadratic[(a, f - D - 1)]
            }
        });
        let lumped = functions.tr_mul(&DVector::from_column_slice(&masses));
        let missing = DVector::from_fn(
            count,
            |f, _| if f <= D { 0.0 } else { represented[f - D - 1] },
        );
        Self {
            functions,
            masses,
            lumped,
            missing,
        }
    }

    /// Returns the factors that correct this fraction of the missing moments, if any do.
    fn factors(&self, corrected: f64) -> Option<Vec<f64>> {
        let change = LeastChange {
            functions: &self.functions,
            masses: &self.masses,
            least: SMALLEST_FACTOR,
        };
        change.factors(&(&self.lumped + &self.missing * corrected))
    }
}

/// Returns the part of moments that nodes with this Gram matrix of functions can represent.
fn represented(gram: DMatrix<f64>, moments: &DVector<f64>) -> DVector<f64> {
    let eigen = gram.symmetric_eigen();
    let mut sum = DVector::zeros(moments.len());
    for (mode, &value) in eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues) {
        let part = mode.dot(moments);
        if value > RANK_TOLERANCE && part.abs() <= LARGEST_CHANGE * value.sqrt() {
            sum += mode * part;
        }
    }
    sum
}

/// Quadratic functions of the fit, in 2-D and 3-D: sums of products of two coordinates.
const QUADRATICS: [&[&[(usize, usize)]]; 2] = [
    &[&[(0, 0), (1, 1)]],
    &[
        &[(0, 0)],
        &[(1, 1)],
        &[(2, 2)],
        &[(0, 1)],
        &[(1, 2)],
        &[(2, 0)],
    ],
];
