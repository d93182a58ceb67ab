//! Total Lagrangian kinematics with St Venant–Kirchhoff elasticity.

use crate::element::element_set::{ElementRecord, ElementRecordMut, Formulation, StressIntegral};
use crate::element::geometry::{self, IntegrationPoints, Lame, Moduli, NodalValues};
use crate::element::simd::Real;
use crate::element::tensor::{self, Tensor};
use crate::scene::Kinematics;

/// Total Lagrangian formulation: S = C:E with E = ½(H + Hᵀ + HᵀH), H = F − I, on the configuration
/// at rest, without history. E computed from H keeps its digits at small strain.
pub(super) struct TotalLagrangian;

impl<const D: usize, const N: usize, const Q: usize> Formulation<D, N, Q> for TotalLagrangian {
    const KINEMATICS: Kinematics = Kinematics::Total;

    const RECORD: usize = 0;

    #[inline(always)]
    fn respond<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        u: &NodalValues<D, N, T>,
        _: &mut (impl ElementRecordMut<T> + ?Sized),
    ) -> NodalValues<D, N, T> {
        let mut force = geometry::nothing(u);
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let h = geometry::gradient(&gradients, u);
            let second_piola = element.lame().stress(&green_lagrange(&h));
            let first_piola = push_forward(&h, &second_piola);
            geometry::subtract_divergence(&mut force, &first_piola, &gradients, volume);
        }
        geometry::balance(&mut force);
        force
    }

    /// Ṡ = C:sym(Fᵀ Ḟ).
    #[inline(always)]
    fn stress_rate<T: Real>(lame: &Lame<T>, h: &Tensor<D, T>, rate: &Tensor<D, T>) -> Tensor<D, T> {
        push_forward(h, &lame.stress(&green_lagrange_rate(h, rate)))
    }

    #[inline(always)]
    fn strain_energy<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        u: &NodalValues<D, N, T>,
        _: &(impl ElementRecord<T> + ?Sized),
    ) -> T {
        let half = u[0][0].constant(0.5);
        let mut energy = half.constant(0.0);
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let strain = green_lagrange(&geometry::gradient(&gradients, u));
            let stress = element.lame().stress(&strain);
            energy += half * volume * tensor::contraction(&stress, &strain);
        }
        energy
    }

    #[inline(always)]
    fn stress<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        moduli: &Moduli,
        u: &NodalValues<D, N, T>,
        _: &(impl ElementRecord<T> + ?Sized),
    ) -> StressIntegral<T> {
        let out_of_plane = u[0][0].constant(moduli.out_of_plane);
        let mut integral = StressIntegral::new(u[0][0].constant(0.0));
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let h = geometry::gradient(&gradients, u);
            let f = tensor::with_unit(&h);
            let second_piola = element.lame().stress(&green_lagrange(&h));
            let kirchhoff = tensor::product_transposed(&tensor::product(&f, &second_piola), &f);
            // F_zz = 1 in plane strain, so τ_zz = S_zz = ν (S_xx + S_yy).
            let across = out_of_plane * tensor::trace(&second_piola);
            integral.add(volume, tensor::determinant(&f), &kirchhoff, across);
        }
        integral
    }
}

/// Returns Green's strain, ½(H + Hᵀ + HᵀH).
#[inline(always)]
pub(super) fn green_lagrange<const D: usize, T: Real>(h: &Tensor<D, T>) -> Tensor<D, T> {
    let quadratic = tensor::transposed_product(h, h);
    let half = h[0][0].constant(0.5);
    tensor::filled(|i, j| half * (h[i][j] + h[j][i] + quadratic[i][j]))
}

/// Returns Ė = sym(Fᵀ Ḟ); `rate` is Ḟ.
#[inline(always)]
pub(super) fn green_lagrange_rate<const D: usize, T: Real>(
    h: &Tensor<D, T>,
    rate: &Tensor<D, T>,
) -> Tensor<D, T> {
    tensor::symmetric(&tensor::sum(rate, &tensor::transposed_product(h, rate)))
}

/// Returns P = F·S = S + H·S.
#[inline(always)]
fn push_forward<const D: usize, T: Real>(
    h: &Tensor<D, T>,
    second_piola: &Tensor<D, T>,
) -> Tensor<D, T> {
    tensor::sum(second_piola, &tensor::product(h, second_piola))
}
