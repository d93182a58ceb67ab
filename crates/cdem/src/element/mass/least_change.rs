//! Least change of nodal masses that gives them wanted moments, with a bound from below.

use nalgebra::{DMatrix, DVector};

/// Fraction of the largest eigenvalue below which the nodes cannot represent a moment: some
/// four hundred machine epsilons.
const RANK: f64 = 1e-13;

/// Error of a moment that is round-off once Newton steps no longer halve it, over the mass. The
/// functions are near 1. Most meshes reach 1e-15; few nodes above the bound amplify it.
const MOMENT_ROUND_OFF: f64 = 1e-10;

/// Distance of a factor below its bound at which the node still counts as above it. Round-off would
/// decide for a node at the bound, and Newton steps without it would go astray.
const AT_BOUND: f64 = 1e-9;

/// Most Newton steps (count). Each step changes the set of nodes at the bound; about ten are
/// enough for a mesh whose moments can be reached.
const MOST_STEPS: usize = 60;

/// Most halvings, and most doublings, of a Newton step (count).
const MOST_HALVINGS: usize = 30;
const MOST_DOUBLINGS: usize = 30;

/// Weight of the identity added to the Hessian, over the largest missing moment (regularised
/// semismooth Newton): nodes above the bound may be too few for some moments.
const REGULARISATION: f64 = 1e-3;

/// Decrease of the objective over that of its tangent, at which a step is long enough (Armijo).
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Nodal masses, and functions φ whose moments Σ m f φ the factors f must match.
pub(crate) struct LeastChange<'a> {
    /// φ of each node (rows) and function (columns), of order 1. The first function is 1.
    pub(crate) functions: &'a DMatrix<f64>,
    /// Masses, over the mass of all.
    pub(crate) masses: &'a [f64],
    /// Least factor.
    pub(crate) least: f64,
}

impl LeastChange<'_> {
    /// Returns the factors f that minimise Σ m (f − 1)² among those of at least `least` with the
    /// moments Σ m f φ = `wanted`. Returns `None` if no factors have these moments, or if the
    /// method does not converge.
    ///
    /// The factors are max(least, 1 + φ·y). The multipliers y minimise a convex function, with the
    /// moment errors as its gradient. Its Hessian is that of the nodes above the bound. A semismooth
    /// Newton method \[Qi1993\] with a line search ends after a few changes of that set.
    pub(crate) fn factors(&self, wanted: &DVector<f64>) -> Option<Vec<f64>> {
        let masses = DVector::from_column_slice(self.masses);
        let above = wanted - self.functions.tr_mul(&masses) * self.least;
        let mut multipliers = DVector::zeros(wanted.len());
        for _ in 0..MOST_STEPS {
            let free = self.functions * &multipliers;
            if self.is_out_of_reach(&multipliers, &free, &above) {
                return None;
            }
            let missing = self.missing(&free, wanted);
            let direction = self.newton_direction(&free, &missing)?;
            let end = &multipliers + &direction;
            let remaining = self.missing(&(self.functions * &end), wanted);
            // Near the end, the objective is constant to round-off, so the errors decide.
            multipliers = if remaining.amax() < 0.5 * missing.amax() {
                end
            } else if missing.amax() <= self.round_off() {
                return Some(free.iter().map(|&s| self.factor(s)).collect());
            } else {
                self.line_search(&multipliers, &direction, wanted, &missing)?
            };
        }
        None
    }

    /// Returns the error of a moment that is round-off: of a sum over very many nodes, the machine
    /// epsilon for each.
    fn round_off(&self) -> f64 {
        MOMENT_ROUND_OFF.max(f64::EPSILON * self.masses.len() as f64)
    }

    /// True if the multipliers y prove that no factors have the moments (Farkas). With f at least
    /// `least`, Σ m (f − least) φ·y is at most the largest φ·y times Σ m (f − least). `free` has
    /// φ·y of the nodes; `above` are the moments Σ m (f − least) φ.
    fn is_out_of_reach(
        &self,
        multipliers: &DVector<f64>,
        free: &DVector<f64>,
        above: &DVector<f64>,
    ) -> bool {
        above.dot(multipliers) > free.max() * above[0] + self.round_off() * multipliers.amax()
    }

    /// Returns the factor of a node whose functions give `free`.
    fn factor(&self, free: f64) -> f64 {
        (1.0 + free).max(self.least)
    }

    /// Returns the moments that the factors lack.
    fn missing(&self, free: &DVector<f64>, wanted: &DVector<f64>) -> DVector<f64> {
        let loaded = DVector::from_fn(free.len(), |node, _| {
            self.masses[node] * self.factor(free[node])
        });
        wanted - self.functions.tr_mul(&loaded)
    }

    /// Returns the convex function of the multipliers, up to a constant.
    fn objective(&self, multipliers: &DVector<f64>, wanted: &DVector<f64>) -> f64 {
        let free = self.functions * multipliers;
        let bound = self.least - 1.0;
        let of_node = |(&s, mass): (&f64, &f64)| {
            let above = s.max(bound);
            mass * (above + 0.5 * above * above + self.least * (s - above))
        };
        free.iter().zip(self.masses).map(of_node).sum::<f64>() - wanted.dot(multipliers)
    }

    /// Returns the Newton direction. Returns `None` if all nodes together cannot represent a moment
    /// that is missing.
    fn newton_direction(
        &self,
        free: &DVector<f64>,
        missing: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let is_free = |node: usize| 1.0 + free[node] > self.least - AT_BOUND;
        let all_free = (0..free.len()).all(is_free);
        let weighted = DMatrix::from_fn(free.len(), missing.len(), |node, f| {
            let weight = if is_free(node) {
                self.masses[node]
            } else {
                0.0
            };
            weight * self.functions[(node, f)]
        });
        let eigen = self.functions.tr_mul(&weighted).symmetric_eigen();
        let rank = RANK * eigen.eigenvalues.max();
        let added = if all_free {
            0.0
        } else {
            rank.max(REGULARISATION * missing.amax())
        };
        let mut direction = DVector::zeros(missing.len());
        for (mode, &value) in eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues) {
            let part = mode.dot(missing);
            if !all_free || value > rank {
                direction += mode * (part / (value.max(0.0) + added));
            } else if part.abs() > self.round_off() {
                return None;
            }
        }
        Some(direction)
    }

    /// Returns the multipliers after a step that decreases the objective. Returns `None` if
    /// round-off leaves no such step.
    fn line_search(
        &self,
        start: &DVector<f64>,
        direction: &DVector<f64>,
        wanted: &DVector<f64>,
        missing: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let (before, slope) = (self.objective(start, wanted), missing.dot(direction));
        let round_off = f64::EPSILON * (1.0 + before.abs());
        let objective = |length: f64| self.objective(&(start + direction * length), wanted);
        let mut length = 1.0;
        for _ in 0..MOST_HALVINGS {
            let decrease = before - objective(length);
            if decrease + round_off >= SUFFICIENT_DECREASE * length * slope {
                return Some(start + direction * lengthened(length, objective));
            }
            length *= 0.5;
        }
        None
    }
}

/// Returns a step length, doubled as long as the `objective` decreases. Few nodes above the bound
/// give little curvature, so their multipliers may be far away.
fn lengthened(mut length: f64, objective: impl Fn(f64) -> f64) -> f64 {
    let mut least = objective(length);
    for _ in 0..MOST_DOUBLINGS {
        let next = objective(2.0 * length);
        if next >= least {
            break;
        }
        (length, least) = (2.0 * length, next);
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LEAST: f64 = 0.3;

    /// Returns 1, x, y, x², xy and y² at points.
    fn functions(points: &[[f64; 2]]) -> DMatrix<f64> {
        DMatrix::from_fn(points.len(), 6, |a, f| {
            let [x, y] = points[a];
            [1.0, x, y, x * x, x * y, y * y][f]
        })
    }

    fn square(masses: &[f64], factors: &[f64]) -> f64 {
        let change = |(mass, factor): (&f64, &f64)| mass * (factor - 1.0) * (factor - 1.0);
        masses.iter().zip(factors).map(change).sum()
    }

    /// Points, masses, and factors of which every other may be at the bound.
    fn loaded_points() -> impl Strategy<Value = Vec<([f64; 2], f64, f64)>> {
        let point = [-1.5..1.5_f64, -1.5..1.5];
        let factor = prop_oneof![Just(LEAST), LEAST..3.0_f64];
        prop::collection::vec((point, 0.1..1.0_f64, factor), 6..60)
    }

    proptest! {
        /// The moments of any allowed factors are reached, with no more change than theirs.
        #[test]
        fn moments_of_allowed_factors_are_reached_with_the_least_change(loads in loaded_points()) {
            let points: Vec<[f64; 2]> = loads.iter().map(|load| load.0).collect();
            let total: f64 = loads.iter().map(|load| load.1).sum();
            let masses: Vec<f64> = loads.iter().map(|load| load.1 / total).collect();
            let allowed: Vec<f64> = loads.iter().map(|load| load.2).collect();
            let functions = functions(&points);
            let moments = |factors: &[f64]| {
                functions.tr_mul(&DVector::from_fn(masses.len(), |a, _| masses[a] * factors[a]))
            };
            let wanted = moments(&allowed);
            // Points on one conic cannot represent all moments.
            let weighted = DMatrix::from_fn(masses.len(), 6, |a, f| masses[a] * functions[(a, f)]);
            let eigenvalues = functions.tr_mul(&weighted).symmetric_eigenvalues();
            prop_assume!(eigenvalues.min() > 10.0 * RANK * eigenvalues.max());
            let change = LeastChange { functions: &functions, masses: &masses, least: LEAST };
            let found = change.factors(&wanted);
            prop_assert!(found.is_some());
            let found = found.unwrap_or_default();
            prop_assert!(found.iter().all(|&factor| factor >= LEAST));
            prop_assert!((moments(&found) - wanted).amax() <= MOMENT_ROUND_OFF);
            let [least, other] = [&found, &allowed].map(|factors| square(&masses, factors));
            prop_assert!(least <= other * (1.0 + 1e-9) + 1e-12, "{least} {other}");
        }
    }

    #[test]
    fn moments_out_of_reach_have_no_factors() {
        let points = [
            [-1.0, -1.0],
            [1.0, -1.0],
            [1.0, 1.0],
            [-1.0, 1.0],
            [0.0, 0.0],
            [0.5, 0.0],
            [0.0, 0.4],
        ];
        let masses = [1.0 / 7.0; 7];
        let functions = functions(&points);
        let change = LeastChange {
            functions: &functions,
            masses: &masses,
            least: LEAST,
        };
        // No node is farther from the y axis than 1, and the corners keep 0.3 of their mass.
        for x_square in [1.1, 0.1] {
            assert_eq!(
                change.factors(&DVector::from_column_slice(&[
                    1.0, 0.0, 0.0, x_square, 0.0, 0.5
                ])),
                None
            );
        }
        let reached = DVector::from_column_slice(&[1.0, 0.0, 0.0, 0.5, 0.0, 0.5]);
        assert!(change.factors(&reached).is_some());
    }
}
