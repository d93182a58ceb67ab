//! Total Lagrangian kinematics with St Venant–Kirchhoff elasticity.

use super::geometry::{self, Nodal, View};
use super::set::{Formulation, StressIntegral};
use super::tensor::{self, Tensor};
use crate::scene::Kinematics;

/// S = C:E with E = ½(H + Hᵀ + HᵀH), H = F − I, on the configuration at rest;
/// no history. E from H keeps its digits at small strain.
pub(super) struct Total;

impl<const D: usize, const N: usize, const Q: usize> Formulation<D, N, Q> for Total {
    type Update = ();

    const KINEMATICS: Kinematics = Kinematics::Total;

    #[inline]
    fn respond(&self, _: usize, element: View<D, N, Q>, u: &Nodal<D, N>) -> (Nodal<D, N>, ()) {
        let mut force = [[0.0; D]; N];
        for (gradients, &volume) in element.gradients.iter().zip(element.volumes) {
            let h = geometry::gradient(gradients, u);
            let second_piola = element.moduli.stress(&green_lagrange(&h));
            let first_piola = push_forward(&h, &second_piola);
            geometry::subtract_divergence(&mut force, &first_piola, gradients, volume);
        }
        geometry::balance(&mut force);
        (force, ())
    }

    #[inline]
    fn commit(&mut self, _: usize, _: &Nodal<D, N>, _: &Nodal<D, N>, (): ()) {}

    /// Ṡ = C:sym(Fᵀ Ḟ).
    #[inline]
    fn force_rate(element: View<D, N, Q>, u: &Nodal<D, N>, velocity: &Nodal<D, N>) -> Nodal<D, N> {
        let mut force = [[0.0; D]; N];
        for (gradients, &volume) in element.gradients.iter().zip(element.volumes) {
            let h = geometry::gradient(gradients, u);
            let rate = geometry::gradient(gradients, velocity);
            let second_piola = element.moduli.stress(&green_lagrange_rate(&h, &rate));
            let first_piola = push_forward(&h, &second_piola);
            geometry::subtract_divergence(&mut force, &first_piola, gradients, volume);
        }
        geometry::balance(&mut force);
        force
    }

    fn strain_energy(&self, _: usize, element: View<D, N, Q>, u: &Nodal<D, N>) -> f64 {
        let mut energy = 0.0;
        for (gradients, &volume) in element.gradients.iter().zip(element.volumes) {
            let strain = green_lagrange(&geometry::gradient(gradients, u));
            let stress = element.moduli.stress(&strain);
            energy += 0.5 * volume * tensor::contraction(&stress, &strain);
        }
        energy
    }

    fn stress(&self, _: usize, element: View<D, N, Q>, u: &Nodal<D, N>) -> StressIntegral<D> {
        let mut integral = StressIntegral::default();
        for (gradients, &volume) in element.gradients.iter().zip(element.volumes) {
            let h = geometry::gradient(gradients, u);
            let f = tensor::sum(&tensor::identity(), &h);
            let second_piola = element.moduli.stress(&green_lagrange(&h));
            let kirchhoff = tensor::product_transposed(&tensor::product(&f, &second_piola), &f);
            // F_zz = 1 in plane strain, so τ_zz = S_zz = ν (S_xx + S_yy).
            let across = element.moduli.out_of_plane * tensor::trace(&second_piola);
            integral.add(volume, tensor::determinant(&f), &kirchhoff, across);
        }
        integral
    }
}

/// ½(H + Hᵀ + HᵀH).
#[inline]
fn green_lagrange<const D: usize>(h: &Tensor<D>) -> Tensor<D> {
    let quadratic = tensor::transposed_product(h, h);
    tensor::filled(|i, j| 0.5 * (h[i][j] + h[j][i] + quadratic[i][j]))
}

/// Ė = sym(Fᵀ Ḟ), `rate` being Ḟ.
#[inline]
pub(super) fn green_lagrange_rate<const D: usize>(h: &Tensor<D>, rate: &Tensor<D>) -> Tensor<D> {
    tensor::symmetric(&tensor::sum(rate, &tensor::transposed_product(h, rate)))
}

/// P = F·S = S + H·S.
#[inline]
fn push_forward<const D: usize>(h: &Tensor<D>, second_piola: &Tensor<D>) -> Tensor<D> {
    tensor::sum(second_piola, &tensor::product(h, second_piola))
}
