//! Nodal masses fitted to the exact mass, centre and inertia of a block.

use nalgebra::{DMatrix, DVector};

use crate::element::mass::SMALLEST_FACTOR;
use crate::element::mass::inertia::SecondMoments;

/// Eigenvalue of the fit below which the nodes cannot represent a moment. There a quadratic
/// function is linear on the nodes up to round-off.
const RANK_TOLERANCE: f64 = 1e-10;

/// Factors 1 + q(X_a) on lumped masses, where q is a quadratic polynomial.
///
/// 2-D: mass, centre and polar moment are exact (q of r² and linear terms); 3-D: all ten moments up
/// to the second. Lumped masses have the exact mass and centre already, so q is sought among
/// quadratic functions orthogonal to the linear ones. Only second moments remain as equations.
/// Moments that the nodes cannot represent, as through one layer of elements, are left out in the
/// least-squares sense; mass and centre stay exact.
pub(super) struct MassFit {
    /// Factor of each node; each above [`SMALLEST_FACTOR`].
    pub(super) factors: Vec<f64>,
    /// Smallest factor of the fit to all moments that the nodes can represent. If it is too small,
    /// `factors` leave out the moments with the smallest eigenvalues.
    pub(super) smallest_full_factor: f64,
}

impl MassFit {
    /// Computes the fit for nodes at `rest` with the masses `lumped`, kg.
    pub(super) fn new<const D: usize>(
        inertia: &SecondMoments<D>,
        rest: &[[f64; D]],
        lumped: &[f64],
    ) -> Self {
        let system = FitEquations::new(inertia, rest, lumped);
        let eigen = (system.quadratic.transpose() * &system.quadratic).symmetric_eigen();
        let mut carried: Vec<usize> = (0..eigen.eigenvalues.len())
            .filter(|&k| eigen.eigenvalues[k] > RANK_TOLERANCE)
            .collect();
        carried.sort_by(|&k, &l| eigen.eigenvalues[l].total_cmp(&eigen.eigenvalues[k]));

        let mut smallest_full_factor = None;
        loop {
            let mut coefficients = DVector::zeros(system.missing.len());
            for &k in &carried {
                let mode = eigen.eigenvectors.column(k);
                coefficients += mode * (mode.dot(&system.missing) / eigen.eigenvalues[k]);
            }
            let factors = system.factors(&coefficients);
            let smallest = factors.iter().copied().fold(f64::INFINITY, f64::min);
            let full = *smallest_full_factor.get_or_insert(smallest);
            if smallest > SMALLEST_FACTOR {
                return Self {
                    factors,
                    smallest_full_factor: full,
                };
            }
            // Without modes all factors are 1, so the loop ends.
            carried.pop();
        }
    }
}

/// The equations of a fit: Qᵀ Q y = missing, factors 1 + Q y / √w.
struct FitEquations {
    /// √w·g̃ of each node (rows) and quadratic function (columns), where w is the mass of the node
    /// over that of the block.
    quadratic: DMatrix<f64>,
    /// Moments of the functions g̃ that the lumped masses lack.
    missing: DVector<f64>,
    /// √w of each node.
    root: DVector<f64>,
}

impl FitEquations {
    fn new<const D: usize>(inertia: &SecondMoments<D>, rest: &[[f64; D]], lumped: &[f64]) -> Self {
        let local: Vec<[f64; D]> = rest.iter().map(|point| inertia.local(point)).collect();
        let root = DVector::from_fn(rest.len(), |a, _| (lumped[a] / inertia.mass()).sqrt());
        let linear = DMatrix::from_fn(rest.len(), D + 1, |a, k| {
            root[a] * if k == 0 { 1.0 } else { local[a][k - 1] }
        });
        let functions = QUADRATICS[D - 2];
        let mut quadratic = DMatrix::from_fn(rest.len(), functions.len(), |a, f| {
            let terms = functions[f].iter();
            root[a] * terms.map(|&(k, l)| local[a][k] * local[a][l]).sum::<f64>()
        });
        let exact = |&(k, l): &(usize, usize)| inertia.second(k, l);
        let mut missing = DVector::from_fn(functions.len(), |f, _| {
            functions[f].iter().map(exact).sum::<f64>()
        });
        let normal = linear.transpose() * &linear;
        if let Some(cholesky) = normal.cholesky() {
            // The second pass removes the round-off of the first.
            for _ in 0..2 {
                let part = cholesky.solve(&(linear.transpose() * &quadratic));
                quadratic -= &linear * &part;
                missing -= part.row(0).transpose();
            }
        } else {
            // Nodes in one plane have no moments to fit.
            quadratic.fill(0.0);
        }
        Self {
            quadratic,
            missing,
            root,
        }
    }

    fn factors(&self, coefficients: &DVector<f64>) -> Vec<f64> {
        let change = &self.quadratic * coefficients;
        change
            .iter()
            .zip(self.root.iter())
            .map(|(q, root)| 1.0 + q / root)
            .collect()
    }
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
