//! The one implementation of [`ElementSet`].

use super::frequency;
use super::geometry::{self, Geometry, Nodal, View};
use super::tensor::{self, Tensor};
use super::{Deformation, ElementSet, Past};
use crate::scene::Kinematics;
use crate::vector::sub;

/// How an element turns nodal displacements into forces.
///
/// Nodal displacements and velocities are relative to the element's first
/// node.
pub(super) trait Formulation<const D: usize, const N: usize, const Q: usize>:
    Send + Sync
{
    /// What a kick changes in the history.
    type Update;

    /// Its name in scenes.
    const KINEMATICS: Kinematics;

    /// Nodal forces of element `i`, N, and what to commit with them.
    fn respond(
        &self,
        i: usize,
        element: View<D, N, Q>,
        displacement: &Nodal<D, N>,
    ) -> (Nodal<D, N>, Self::Update);

    /// Makes `displacement` and `force` of a response the element's last.
    fn commit(
        &mut self,
        i: usize,
        displacement: &Nodal<D, N>,
        force: &Nodal<D, N>,
        update: Self::Update,
    );

    /// What strain rates change of the nodal forces in a second, N/s; times β,
    /// the forces of stiffness-proportional damping.
    fn force_rate(
        element: View<D, N, Q>,
        displacement: &Nodal<D, N>,
        velocity: &Nodal<D, N>,
    ) -> Nodal<D, N>;

    /// Strain energy of element `i`, J.
    fn strain_energy(&self, i: usize, element: View<D, N, Q>, displacement: &Nodal<D, N>) -> f64;

    /// Cauchy stress of element `i`, integrated.
    fn stress(
        &self,
        i: usize,
        element: View<D, N, Q>,
        displacement: &Nodal<D, N>,
    ) -> StressIntegral<D>;

    /// What element `i` knows of its past, if that matters.
    fn past(&self, _i: usize, _element: View<D, N, Q>) -> Option<Past<D>> {
        None
    }

    /// Gives element `i`, deformed by `displacement` now, that past.
    fn set_past(
        &mut self,
        _i: usize,
        _element: View<D, N, Q>,
        _past: &Past<D>,
        _displacement: &Nodal<D, N>,
    ) {
    }

    /// The records of all elements, if any, of the same length each.
    fn history(&self) -> &[f64] {
        &[]
    }

    /// The same, to be changed.
    fn history_mut(&mut self) -> &mut [f64] {
        &mut []
    }
}

/// ∫σ over the current volume, and that volume.
pub(super) struct StressIntegral<const D: usize> {
    stress: [f64; 6],
    volume: f64,
}

impl<const D: usize> Default for StressIntegral<D> {
    fn default() -> Self {
        Self {
            stress: [0.0; 6],
            volume: 0.0,
        }
    }
}

impl<const D: usize> StressIntegral<D> {
    /// A Gauss point of `volume` at rest with det F, Kirchhoff stress τ = Jσ,
    /// and in 2-D τ_zz `across`.
    pub(super) fn add(&mut self, volume: f64, jacobian: f64, kirchhoff: &Tensor<D>, across: f64) {
        let t = kirchhoff;
        let voigt = if D == 2 {
            [t[0][0], t[1][1], across, t[0][1], 0.0, 0.0]
        } else {
            [t[0][0], t[1][1], t[2][2], t[0][1], t[1][2], t[2][0]]
        };
        for (total, component) in self.stress.iter_mut().zip(voigt) {
            *total += volume * component;
        }
        self.volume += volume * jacobian;
    }

    fn average(&self) -> [f64; 6] {
        self.stress.map(|component| component / self.volume)
    }
}

/// Elements of one shape in one formulation.
pub(super) struct Set<const D: usize, const N: usize, const Q: usize, F> {
    geometry: Geometry<D, N, Q>,
    formulation: F,
}

impl<const D: usize, const N: usize, const Q: usize, F> Set<D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    pub(super) fn new(geometry: Geometry<D, N, Q>, formulation: F) -> Self {
        Self {
            geometry,
            formulation,
        }
    }

    /// `field` at the nodes of element `i`, less that of its first node.
    #[inline]
    fn relative(&self, i: usize, field: &[[f64; D]]) -> Nodal<D, N> {
        let nodes = self.geometry.nodes(i);
        let first = field[nodes[0] as usize];
        let mut relative = [[0.0; D]; N];
        for a in 0..N {
            for k in 0..D {
                relative[a][k] = field[nodes[a] as usize][k] - first[k];
            }
        }
        relative
    }

    #[inline]
    fn scatter(&self, i: usize, interval: f64, force: &Nodal<D, N>, impulse: &mut [[f64; D]]) {
        for (node, force) in self.geometry.nodes(i).iter().zip(force) {
            let target = &mut impulse[*node as usize];
            for k in 0..D {
                target[k] += interval * force[k];
            }
        }
    }

    #[inline]
    fn scatter_viscous(
        &self,
        i: usize,
        interval: f64,
        displacement: &Nodal<D, N>,
        velocity: &[[f64; D]],
        viscous: &mut [[f64; D]],
    ) {
        let element = self.geometry.view(i);
        let damping = element.moduli.damping;
        if damping > 0.0 {
            let velocity = self.relative(i, velocity);
            let rate = F::force_rate(element, displacement, &velocity);
            self.scatter(i, damping * interval, &rate, viscous);
        }
    }
}

impl<const D: usize, const N: usize, const Q: usize, F> ElementSet<D> for Set<D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    fn kinematics(&self) -> Kinematics {
        F::KINEMATICS
    }

    fn len(&self) -> usize {
        self.geometry.mesh_elements().len()
    }

    fn mesh_elements(&self) -> &[u32] {
        self.geometry.mesh_elements()
    }

    fn nodes(&self, i: usize) -> &[u32] {
        self.geometry.nodes(i)
    }

    fn kick(
        &mut self,
        due: &[u32],
        interval: &[f64],
        displacement: &[[f64; D]],
        velocity: &[[f64; D]],
        impulse: &mut [[f64; D]],
        viscous: &mut [[f64; D]],
    ) {
        assert_eq!(
            due.len(),
            interval.len(),
            "one interval for each element due"
        );
        for (&i, &interval) in due.iter().zip(interval) {
            let i = i as usize;
            let u = self.relative(i, displacement);
            let (force, update) = self.formulation.respond(i, self.geometry.view(i), &u);
            self.scatter(i, interval, &force, impulse);
            self.scatter_viscous(i, interval, &u, velocity, viscous);
            self.formulation.commit(i, &u, &force, update);
        }
    }

    fn peek(
        &self,
        due: &[u32],
        interval: &[f64],
        displacement: &[[f64; D]],
        velocity: &[[f64; D]],
        impulse: &mut [[f64; D]],
        viscous: &mut [[f64; D]],
    ) {
        assert_eq!(
            due.len(),
            interval.len(),
            "one interval for each element due"
        );
        for (&i, &interval) in due.iter().zip(interval) {
            let i = i as usize;
            let u = self.relative(i, displacement);
            let (force, _) = self.formulation.respond(i, self.geometry.view(i), &u);
            self.scatter(i, interval, &force, impulse);
            self.scatter_viscous(i, interval, &u, velocity, viscous);
        }
    }

    fn strain_energy(&self, i: usize, displacement: &[[f64; D]]) -> f64 {
        let u = self.relative(i, displacement);
        self.formulation.strain_energy(i, self.geometry.view(i), &u)
    }

    fn force(&self, i: usize, displacement: &[[f64; D]], force: &mut [[f64; D]]) {
        let u = self.relative(i, displacement);
        let (now, _) = self.formulation.respond(i, self.geometry.view(i), &u);
        force[..N].copy_from_slice(&now);
    }

    fn force_rate(
        &self,
        i: usize,
        displacement: &[[f64; D]],
        velocity: &[[f64; D]],
        rate: &mut [[f64; D]],
    ) {
        let u = self.relative(i, displacement);
        let velocity = std::array::from_fn(|a| sub(&velocity[a], &velocity[0]));
        rate[..N].copy_from_slice(&F::force_rate(self.geometry.view(i), &u, &velocity));
    }

    fn stress(&self, i: usize, displacement: &[[f64; D]]) -> [f64; 6] {
        let u = self.relative(i, displacement);
        self.formulation
            .stress(i, self.geometry.view(i), &u)
            .average()
    }

    fn deformation(&self, i: usize, displacement: &[[f64; D]]) -> Deformation {
        let u = self.relative(i, displacement);
        let mut extremes = Deformation {
            min_jacobian: f64::INFINITY,
            min_stretch: f64::INFINITY,
            max_stretch: 0.0,
        };
        for gradients in self.geometry.view(i).gradients {
            let f = tensor::sum(&tensor::identity(), &geometry::gradient(gradients, &u));
            let right_cauchy = tensor::transposed_product(&f, &f);
            let (low, high) = tensor::extreme_principal_values(&right_cauchy);
            extremes.min_jacobian = extremes.min_jacobian.min(tensor::determinant(&f));
            extremes.min_stretch = extremes.min_stretch.min(low.max(0.0).sqrt());
            extremes.max_stretch = extremes.max_stretch.max(high.sqrt());
        }
        extremes
    }

    fn frequency(&self, i: usize, mass_factor: &[f64]) -> f64 {
        let mut mass = self.geometry.lumped_mass(i);
        for (mass, node) in mass.iter_mut().zip(self.geometry.nodes(i)) {
            *mass *= mass_factor[*node as usize];
        }
        frequency::lumped(self.geometry.view(i), &mass)
    }

    fn consistent_frequency(&self, i: usize) -> f64 {
        frequency::consistent(self.geometry.view(i), &self.geometry.consistent_mass(i))
    }

    fn lumped_mass(&self, i: usize, out: &mut [f64]) {
        out[..N].copy_from_slice(&self.geometry.lumped_mass(i));
    }

    fn consistent_mass(&self, i: usize, out: &mut [f64]) {
        let mass = self.geometry.consistent_mass(i);
        out[..N * N].copy_from_slice(mass.as_flattened());
    }

    fn stiffness(&self, i: usize, out: &mut [f64]) {
        let element = self.geometry.view(i);
        for row in 0..N * D {
            for column in 0..N * D {
                out[row * N * D + column] =
                    element.stiffness((row / D, row % D), (column / D, column % D));
            }
        }
    }

    fn record(&self, i: usize) -> &[f64] {
        let all = self.formulation.history();
        let length = all.len() / self.len();
        &all[i * length..][..length]
    }

    fn set_record(&mut self, i: usize, record: &[f64]) {
        let all = self.formulation.history_mut();
        all[i * record.len()..][..record.len()].copy_from_slice(record);
    }

    fn past(&self, i: usize) -> Option<Past<D>> {
        self.formulation.past(i, self.geometry.view(i))
    }

    fn set_past(&mut self, i: usize, past: &Past<D>, displacement: &[[f64; D]]) {
        let u = self.relative(i, displacement);
        self.formulation
            .set_past(i, self.geometry.view(i), past, &u);
    }

    fn memory(&self) -> usize {
        let history = size_of_val(self.formulation.history());
        Geometry::<D, N, Q>::memory() + history / self.len().max(1)
    }
}
