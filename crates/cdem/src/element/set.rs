//! The one implementation of [`ElementSet`].

use std::marker::PhantomData;

use super::frequency;
use super::geometry::{self, Geometry, Moduli, Nodal, View};
use super::kick::{History, Kick};
use super::lanes::{Real, Single};
use super::tensor::{self, Tensor};
use super::total::green_lagrange;
use super::{Deformation, ElementSet, Past};
use crate::scene::Kinematics;
use crate::vector::sub;

/// Most numbers in a record: of a hexahedron with incremental kinematics.
pub(super) const MAX_RECORD: usize = 121;

/// How elements turn nodal displacements into forces.
///
/// Nodal displacements and velocities are relative to the element's first
/// node. A record is what an element keeps from kick to kick.
pub(super) trait Formulation<const D: usize, const N: usize, const Q: usize>:
    Send + Sync
{
    /// Its name in scenes.
    const KINEMATICS: Kinematics;

    /// Numbers in the record of an element.
    const RECORD: usize;

    /// Nodal forces, N; brings the record up to this response.
    fn respond<T: Real>(
        element: View<D, N, Q, T>,
        displacement: &Nodal<D, N, T>,
        record: &mut [T],
    ) -> Nodal<D, N, T>;

    /// What strain rates change of the nodal forces in a second, N/s; times β,
    /// the forces of stiffness-proportional damping.
    fn force_rate<T: Real>(
        element: View<D, N, Q, T>,
        displacement: &Nodal<D, N, T>,
        velocity: &Nodal<D, N, T>,
    ) -> Nodal<D, N, T>;

    /// Strain energy, J.
    fn strain_energy(element: View<D, N, Q>, displacement: &Nodal<D, N>, record: &[f64]) -> f64;

    /// Cauchy stress, integrated.
    fn stress(
        element: View<D, N, Q>,
        moduli: &Moduli,
        displacement: &Nodal<D, N>,
        record: &[f64],
    ) -> StressIntegral<D>;

    /// What an element knows of its past, if that matters.
    fn past(_element: View<D, N, Q>, _moduli: &Moduli, _record: &[f64]) -> Option<Past<D>> {
        None
    }

    /// Gives an element, deformed by `displacement` now, that past.
    fn set_past(
        _element: View<D, N, Q>,
        _moduli: &Moduli,
        _past: &Past<D>,
        _displacement: &Nodal<D, N>,
        _record: &mut [f64],
    ) {
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
    /// The records of all elements.
    history: Vec<f64>,
    formulation: PhantomData<F>,
}

impl<const D: usize, const N: usize, const Q: usize, F> Set<D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    /// Undeformed, stress-free elements.
    pub(super) fn new(geometry: Geometry<D, N, Q>) -> Self {
        Self {
            history: vec![0.0; F::RECORD * geometry.mesh_elements().len()],
            geometry,
            formulation: PhantomData,
        }
    }

    /// `field` at the nodes of element `i`, less that of its first node.
    #[inline]
    fn relative(&self, i: usize, field: &[[f64; D]]) -> Nodal<D, N> {
        self.geometry.relative(Single, &[i as u32], field)
    }

    fn record_of(&self, i: usize) -> &[f64] {
        &self.history[i * F::RECORD..][..F::RECORD]
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
        let history = History::Kept(&mut self.history);
        let (motion, given) = ([displacement, velocity], [impulse, viscous]);
        Kick::<D, N, Q, F>::new(&self.geometry, history, motion, given).run(due, interval);
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
        let history = History::Seen(&self.history);
        let (motion, given) = ([displacement, velocity], [impulse, viscous]);
        Kick::<D, N, Q, F>::new(&self.geometry, history, motion, given).run(due, interval);
    }

    fn strain_energy(&self, i: usize, displacement: &[[f64; D]]) -> f64 {
        let u = self.relative(i, displacement);
        F::strain_energy(self.geometry.view(i), &u, self.record_of(i))
    }

    fn force(&self, i: usize, displacement: &[[f64; D]], force: &mut [[f64; D]]) {
        let u = self.relative(i, displacement);
        let mut record = [0.0; MAX_RECORD];
        let record = &mut record[..F::RECORD];
        record.copy_from_slice(self.record_of(i));
        force[..N].copy_from_slice(&F::respond(self.geometry.view(i), &u, record));
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
        let (element, moduli) = (self.geometry.view(i), self.geometry.moduli(i));
        F::stress(element, moduli, &u, self.record_of(i)).average()
    }

    fn is_strained_within(&self, i: usize, displacement: &[[f64; D]], most: f64) -> bool {
        let u = self.relative(i, displacement);
        let gradients = self.geometry.view(i).gradients.iter();
        let mut displaced = gradients.map(|gradients| geometry::gradient(gradients, &u));
        displaced.all(|h| {
            let strain = green_lagrange(&h);
            let jacobian = tensor::determinant(&tensor::sum(&tensor::identity(1.0), &h));
            jacobian > 0.0 && tensor::contraction(&strain, &strain) <= most * most
        })
    }

    fn deformation(&self, i: usize, displacement: &[[f64; D]]) -> Deformation {
        let u = self.relative(i, displacement);
        let mut extremes = Deformation {
            min_jacobian: f64::INFINITY,
            min_stretch: f64::INFINITY,
            max_stretch: 0.0,
        };
        for gradients in self.geometry.view(i).gradients {
            let f = tensor::sum(&tensor::identity(1.0), &geometry::gradient(gradients, &u));
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
        self.record_of(i)
    }

    fn set_record(&mut self, i: usize, record: &[f64]) {
        self.history[i * F::RECORD..][..F::RECORD].copy_from_slice(record);
    }

    fn past(&self, i: usize) -> Option<Past<D>> {
        let (element, moduli) = (self.geometry.view(i), self.geometry.moduli(i));
        F::past(element, moduli, self.record_of(i))
    }

    fn set_past(&mut self, i: usize, past: &Past<D>, displacement: &[[f64; D]]) {
        let u = self.relative(i, displacement);
        let (element, moduli) = (self.geometry.view(i), self.geometry.moduli(i));
        let record = &mut self.history[i * F::RECORD..][..F::RECORD];
        F::set_past(element, moduli, past, &u, record);
    }

    fn memory(&self) -> usize {
        Geometry::<D, N, Q>::memory() + F::RECORD * size_of::<f64>()
    }
}
