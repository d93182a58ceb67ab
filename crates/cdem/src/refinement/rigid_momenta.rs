//! Momenta of a body, and their restoration after a change of mesh.

use nalgebra::{Matrix3, Vector3};

use crate::math::vector::{add, add_scaled, cross, pad, scale, sub, truncate};

/// Positions of a body's nodes, m, and the momentum of each node, N·s, as a function of all
/// velocities, m/s.
pub(crate) struct MovingBody<'a, const D: usize, M> {
    pub(crate) points: &'a [[f64; D]],
    pub(crate) momentum: M,
}

/// Linear momentum, N·s, and angular momentum about some point, N·m·s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigidMomenta {
    pub(crate) linear: [f64; 3],
    pub(crate) angular: [f64; 3],
}

impl<const D: usize, M: Fn(usize, &[[f64; D]]) -> [f64; D]> MovingBody<'_, D, M> {
    /// Returns the momenta about `centre`.
    pub(crate) fn momenta(&self, velocities: &[[f64; D]], centre: &[f64; D]) -> RigidMomenta {
        let mut momenta = RigidMomenta {
            linear: [0.0; 3],
            angular: [0.0; 3],
        };
        for (node, point) in self.points.iter().enumerate() {
            let momentum = pad(&(self.momentum)(node, velocities));
            add_scaled(&mut momenta.linear, 1.0, &momentum);
            let turn = cross(&pad(&sub(point, centre)), &momentum);
            add_scaled(&mut momenta.angular, 1.0, &turn);
        }
        momenta
    }

    /// Returns the mass, kg, and its centre.
    pub(crate) fn centre(&self) -> (f64, [f64; D]) {
        let mut along_x = [0.0; D];
        along_x[0] = 1.0;
        let unit = vec![along_x; self.points.len()];
        let (mut mass, mut first) = (0.0, [0.0; D]);
        let origin = self.points[0];
        for (node, point) in self.points.iter().enumerate() {
            let share = (self.momentum)(node, &unit)[0];
            mass += share;
            add_scaled(&mut first, share, &sub(point, &origin));
        }
        (mass, add(&origin, &scale(1.0 / mass, &first)))
    }

    fn spin(&self, centre: &[f64; D], angular: &[f64; 3]) -> [f64; 3] {
        let about = |axis: usize| {
            let mut spin = [0.0; 3];
            spin[axis] = 1.0;
            let arm = |point: &[f64; D]| pad(&sub(point, centre));
            let turned = self
                .points
                .iter()
                .map(|point| truncate(&cross(&spin, &arm(point))));
            self.momenta(&turned.collect::<Vec<_>>(), centre).angular
        };
        if D == 2 {
            return [0.0, 0.0, angular[2] / about(2)[2]];
        }
        let columns = [0, 1, 2].map(|axis| Vector3::from(about(axis)));
        let inertia = Matrix3::from_columns(&columns);
        let spin = inertia.lu().solve(&Vector3::from(*angular));
        spin.unwrap_or_default().into()
    }

    /// Adds to `velocities` the rigid motion that gives the body the momenta `wanted` about its
    /// centre.
    pub(crate) fn restore_momenta(&self, velocities: &mut [[f64; D]], wanted: &RigidMomenta) {
        let (mass, centre) = self.centre();
        let arm = |node: usize| pad(&sub(&self.points[node], &centre));
        // The second pass corrects the round-off of the first.
        for _ in 0..2 {
            let now = self.momenta(velocities, &centre);
            let lack = sub(&wanted.angular, &now.angular);
            let spin = self.spin(&centre, &lack);
            let shift = scale(1.0 / mass, &sub(&wanted.linear, &now.linear));
            for (node, velocity) in velocities.iter_mut().enumerate() {
                let change = add(&shift, &cross(&spin, &arm(node)));
                add_scaled(velocity, 1.0, &truncate(&change));
            }
        }
    }
}
