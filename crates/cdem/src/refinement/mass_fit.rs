//! Fit of the masses of the new nodes to the moments of the replaced elements.

use nalgebra::{DMatrix, DVector};

use crate::element::mass::least_change::LeastChange;

/// Mass of some nodes with first and second moments. All masses with the same moments give a rigid
/// or linear velocity field the same momenta and energy.
#[derive(Clone, Debug)]
pub(crate) struct Moments<const D: usize> {
    frame: PrincipalFrame<D>,
    /// Sums over the mass of 1, of the coordinates in the frame, and of their products.
    values: DVector<f64>,
}

/// Coordinates in which some masses have their centre at the origin and the unit tensor of second
/// moments over mass. In them a flat body is as well conditioned as a round one.
#[derive(Clone, Debug)]
struct PrincipalFrame<const D: usize> {
    centre: [f64; D],
    axes: DMatrix<f64>,
}

impl<const D: usize> PrincipalFrame<D> {
    fn new(points: &[[f64; D]], masses: &[f64]) -> Self {
        let all = || points.iter().zip(masses);
        let mass: f64 = masses.iter().sum();
        let mean = |of: &dyn Fn(&[f64; D]) -> f64| -> f64 {
            all().map(|(point, m)| m / mass * of(point)).sum()
        };
        let origin = points[0];
        let centre = std::array::from_fn(|k| origin[k] + mean(&|x| x[k] - origin[k]));
        let second = DMatrix::from_fn(D, D, |k, l| {
            mean(&|x| (x[k] - centre[k]) * (x[l] - centre[l]))
        });
        let axes = second
            .cholesky()
            .and_then(|factor| factor.l().try_inverse());
        Self {
            centre,
            axes: axes.unwrap_or_else(|| DMatrix::identity(D, D)),
        }
    }

    /// Returns 1 and the coordinates of a point.
    fn linear(&self, point: &[f64; D]) -> Vec<f64> {
        let along = |k: usize| {
            (0..D)
                .map(|i| self.axes[(k, i)] * (point[i] - self.centre[i]))
                .sum()
        };
        std::iter::once(1.0).chain((0..D).map(along)).collect()
    }
}

impl<const D: usize> Moments<D> {
    /// Returns zero moments, to be carried by nodes at `points` of about these `masses`, kg.
    pub(crate) fn new(points: &[[f64; D]], masses: &[f64]) -> Self {
        Self {
            frame: PrincipalFrame::new(points, masses),
            values: DVector::zeros((D + 1) * (D + 2) / 2),
        }
    }

    /// Adds ρ∫N_a N_b of two nodes, kg; for a point mass both are the same point.
    pub(crate) fn add(&mut self, mass: f64, a: &[f64; D], b: &[f64; D]) {
        let [a, b] = [a, b].map(|point| self.frame.linear(point));
        let mut values = self.values.iter_mut();
        for k in 0..=D {
            for l in 0..=k {
                if let Some(value) = values.next() {
                    *value += 0.5 * mass * (a[k] * b[l] + a[l] * b[k]);
                }
            }
        }
    }

    /// Returns the [least change](LeastChange) of the `masses`, kg, of nodes at `points` that gives
    /// them these moments: factors of at least `least`. Returns `None` if there are none.
    ///
    /// With many nodes the factor is 1 plus a quadratic polynomial; it tends to 1 with the square
    /// of the distance of the nodes from each other. A polynomial alone would need a tetrahedron
    /// cut into 1024 before it leaves the corners 0.3 of their masses. With this bound 64 are
    /// enough, and 16 triangles in 2-D: two halvings of all elements.
    pub(crate) fn fit(&self, points: &[[f64; D]], masses: &[f64], least: f64) -> Option<Vec<f64>> {
        let mass = self.values[0];
        let masses: Vec<f64> = masses.iter().map(|own| own / mass).collect();
        let change = LeastChange {
            functions: &self.functions(points),
            masses: &masses,
            least,
        };
        change.factors(&(&self.values / mass))
    }

    /// Returns the products of the linear functions (columns) at nodes (rows).
    fn functions(&self, points: &[[f64; D]]) -> DMatrix<f64> {
        let products: Vec<_> = (0..=D).flat_map(|k| (0..=k).map(move |l| (k, l))).collect();
        let linear = points.iter().map(|point| self.frame.linear(point));
        let linear: Vec<_> = linear.collect();
        DMatrix::from_fn(points.len(), products.len(), |node, f| {
            let (k, l) = products[f];
            linear[node][k] * linear[node][l]
        })
    }
}
