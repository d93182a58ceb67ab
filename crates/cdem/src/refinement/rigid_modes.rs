//! Rigid modes of a body with prescribed nodes.

use nalgebra::{DMatrix, DVector};

use crate::math::vector::{add, add_scaled, cross, dot, norm, pad, sub, truncate};
use crate::refinement::rigid_momenta::{MovingBody, RigidMomenta};

/// Fraction of the largest motion of prescribed components below which a motion is round-off.
const ROUND_OFF: f64 = 1e-12;

/// Rigid modes of a body that do not move its prescribed components.
pub(crate) struct RigidModes<'a, const D: usize, M> {
    body: &'a MovingBody<'a, D, M>,
    centre: [f64; D],
    all: Vec<RigidMotion>,
    /// Nodal velocities of each mode.
    fields: Vec<Vec<[f64; D]>>,
    /// Generalised mass matrix: momentum of each mode along each mode.
    inertia: DMatrix<f64>,
}

/// Velocity of a point of a body, and angular velocity.
#[derive(Clone, Copy, Debug, Default)]
struct RigidMotion {
    linear: [f64; 3],
    angular: [f64; 3],
}

impl RigidMotion {
    /// Returns the velocity at the end of an arm from the point.
    fn at<const D: usize>(&self, arm: &[f64; D]) -> [f64; D] {
        truncate(&add(&self.linear, &cross(&self.angular, &pad(arm))))
    }

    /// Returns the component of momenta along the motion.
    fn along(&self, momenta: &RigidMomenta) -> f64 {
        dot(&self.linear, &momenta.linear) + dot(&self.angular, &momenta.angular)
    }

    /// Returns translations along the axes, and rotations about them of equal speed at a `radius`.
    fn units<const D: usize>(radius: f64) -> Vec<Self> {
        let along = |axis: usize, length: f64| {
            let mut vector = [0.0; 3];
            vector[axis] = length;
            vector
        };
        let shifts = (0..D).map(|axis| Self {
            linear: along(axis, 1.0),
            ..Self::default()
        });
        let turns = (if D == 2 { 2 } else { 0 }..3).map(|axis| Self {
            angular: along(axis, 1.0 / radius),
            ..Self::default()
        });
        shifts.chain(turns).collect()
    }
}

impl<'a, const D: usize, M: Fn(usize, &[[f64; D]]) -> [f64; D]> RigidModes<'a, D, M> {
    /// Builds the modes about `centre` of a body with these `prescribed` components.
    pub(crate) fn new(
        body: &'a MovingBody<'a, D, M>,
        centre: [f64; D],
        prescribed: &[[bool; D]],
    ) -> Self {
        let arms: Vec<[f64; D]> = body.points.iter().map(|x| sub(x, &centre)).collect();
        let radius = arms.iter().map(norm).fold(0.0, f64::max);
        let all = free(&RigidMotion::units::<D>(radius), &arms, prescribed);
        let field = |mode: &RigidMotion| {
            let nodes = arms.iter().zip(prescribed);
            let velocity = nodes.map(|(arm, prescribed)| {
                let velocity = mode.at(arm);
                std::array::from_fn(|c| if prescribed[c] { 0.0 } else { velocity[c] })
            });
            velocity.collect::<Vec<[f64; D]>>()
        };
        let fields: Vec<Vec<[f64; D]>> = all.iter().map(field).collect();
        let momenta: Vec<RigidMomenta> = fields.iter().map(|f| body.momenta(f, &centre)).collect();
        let inertia = DMatrix::from_fn(all.len(), all.len(), |k, l| all[k].along(&momenta[l]));
        Self {
            body,
            centre,
            all,
            fields,
            inertia,
        }
    }

    /// Adds to `velocities` the motion that gives the body the momenta `wanted` about the centre,
    /// as far as it is free.
    pub(crate) fn restore_momenta(&self, velocities: &mut [[f64; D]], wanted: &RigidMomenta) {
        // The second pass corrects the round-off of the first.
        for _ in 0..2 {
            let now = self.body.momenta(velocities, &self.centre);
            let lack = RigidMomenta {
                linear: sub(&wanted.linear, &now.linear),
                angular: sub(&wanted.angular, &now.angular),
            };
            for (rate, field) in self.rates(&lack).iter().zip(&self.fields) {
                for (velocity, of_node) in velocities.iter_mut().zip(field) {
                    add_scaled(velocity, *rate, of_node);
                }
            }
        }
    }

    /// Returns the inverse effective mass for an impulse along a unit `normal` at a point, 1/kg.
    pub(crate) fn mobility(&self, point: &[f64; D], normal: &[f64; D]) -> f64 {
        let impulse = RigidMomenta {
            linear: pad(normal),
            angular: cross(&pad(&sub(point, &self.centre)), &pad(normal)),
        };
        let rates = self.rates(&impulse);
        let speeds = rates.iter().zip(&self.all);
        speeds.map(|(rate, mode)| rate * mode.along(&impulse)).sum()
    }

    /// Returns the rate of each mode for these momenta.
    fn rates(&self, momenta: &RigidMomenta) -> Vec<f64> {
        if self.all.is_empty() {
            return Vec::new();
        }
        let along = self.all.iter().map(|mode| mode.along(momenta));
        let along = DVector::from_iterator(self.all.len(), along);
        let rates = self.inertia.clone().lu().solve(&along);
        rates.map_or_else(Vec::new, |rates| rates.iter().copied().collect())
    }
}

/// Returns the combinations of motions that do not move the prescribed components at the ends of
/// these arms.
fn free<const D: usize>(
    units: &[RigidMotion],
    arms: &[[f64; D]],
    prescribed: &[[bool; D]],
) -> Vec<RigidMotion> {
    let mut moved = DMatrix::zeros(units.len(), units.len());
    for (arm, prescribed) in arms.iter().zip(prescribed) {
        for c in (0..D).filter(|&c| prescribed[c]) {
            let of_units = units.iter().map(|unit| unit.at(arm)[c]);
            let of_units = DVector::from_iterator(units.len(), of_units);
            moved += &of_units * of_units.transpose();
        }
    }
    let parts = moved.symmetric_eigen();
    let most = parts.eigenvalues.max();
    let is_free = |k: &usize| parts.eigenvalues[*k] <= ROUND_OFF * most;
    let all = (0..units.len()).filter(is_free).map(|k| {
        let mut sum = RigidMotion::default();
        for (unit, &part) in units.iter().zip(&parts.eigenvectors.column(k)) {
            add_scaled(&mut sum.linear, part, &unit.linear);
            add_scaled(&mut sum.angular, part, &unit.angular);
        }
        sum
    });
    all.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of a box, with 1 kg each.
    const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [0.0, 4.0]];

    fn body(points: &[[f64; 2]]) -> MovingBody<'_, 2, impl Fn(usize, &[[f64; 2]]) -> [f64; 2]> {
        MovingBody {
            points,
            momentum: |node: usize, velocities: &[[f64; 2]]| velocities[node],
        }
    }

    #[test]
    fn what_is_free_moves_as_a_rigid_body() {
        let body = body(&CORNERS);
        let modes = RigidModes::new(&body, [1.5, 2.0], &[[false; 2]; 4]);
        let mobility = modes.mobility(&[3.0, 1.0], &[-1.0, 0.0]);
        assert!(
            (mobility - (1.0 / 4.0 + 1.0 / 25.0)).abs() < 1e-15,
            "{mobility}"
        );
    }

    #[test]
    fn what_is_pinned_turns_about_the_pin() {
        let body = body(&CORNERS);
        let mut prescribed = [[false; 2]; 4];
        prescribed[0] = [true; 2];
        let modes = RigidModes::new(&body, [1.5, 2.0], &prescribed);
        // The moment of inertia about the pin is 9 + 25 + 16 kg m², the arm 4 m.
        let mobility = modes.mobility(&[3.0, 4.0], &[-1.0, 0.0]);
        assert!((mobility - 16.0 / 50.0).abs() < 1e-14, "{mobility}");
        let turned = [[0.0, 0.0], [0.0, 3.0], [-4.0, 3.0], [-4.0, 0.0]];
        let wanted = body.momenta(&turned, &[1.5, 2.0]);
        let mut velocities = [[0.0; 2]; 4];
        modes.restore_momenta(&mut velocities, &wanted);
        for (velocity, turned) in velocities.iter().zip(&turned) {
            assert!(norm(&sub(velocity, turned)) < 1e-14, "{velocities:?}");
        }
    }

    #[test]
    fn what_is_held_at_two_nodes_stays() {
        let body = body(&CORNERS);
        let mut prescribed = [[false; 2]; 4];
        prescribed[0] = [true; 2];
        prescribed[1] = [false, true];
        let modes = RigidModes::new(&body, [1.5, 2.0], &prescribed);
        assert_eq!(modes.mobility(&[3.0, 4.0], &[0.0, 1.0]), 0.0);
    }

    #[test]
    fn what_is_guided_slides() {
        let body = body(&CORNERS);
        let modes = RigidModes::new(&body, [1.5, 2.0], &[[false, true]; 4]);
        assert!(modes.mobility(&[3.0, 4.0], &[0.0, 1.0]).abs() < 1e-15);
        assert!((modes.mobility(&[3.0, 4.0], &[1.0, 0.0]) - 0.25).abs() < 1e-15);
    }
}
