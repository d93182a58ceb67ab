//! The paper's (2): incremental kinematics with objective rotation of stress.

use super::Past;
use super::geometry::{self, Element, Moduli, Nodal, Points};
use super::lanes::Real;
use super::set::{Formulation, MAX_RECORD, StressIntegral};
use super::tensor::{self, Tensor};
use crate::scene::Kinematics;

/// Stress carried along from kick to kick of the element.
///
/// The increment of an element's own interval is taken on the configuration
/// at its middle; stress is turned by Hughes and Winget's rotation Q (1980);
/// forces use gradients and volumes of the end configuration, or angular
/// momentum would be lost.
///
/// # Differences from the paper
/// σ + ½C:Δε is turned and the other half added, Q (σ + ½C:Δε) Qᵀ + ½C:Δε,
/// since Δε belongs to the middle: QσQᵀ + C:Δε is of first order only (10 %
/// wrong after 1 rad in ten steps with 5 % strain; this form is
/// 0.25 % wrong and of second order).
///
/// An element's record: displacements relative to its first node and nodal
/// forces at its last kick (N·D each), Cauchy stress of its Gauss points
/// (Q·D·D), work done on it.
pub(super) struct Incremental;

/// A record, cut into its parts.
struct Record<'a, const D: usize, T = f64> {
    displacement: &'a [[T; D]],
    force: &'a [[T; D]],
    stress: &'a [[T; D]],
    work: T,
}

impl<'a, const D: usize, T: Real> Record<'a, D, T> {
    #[inline(always)]
    fn of(nodes: usize, record: &'a [T]) -> Self {
        let (vectors, work) = record.as_chunks::<D>();
        let (displacement, rest) = vectors.split_at(nodes);
        let (force, stress) = rest.split_at(nodes);
        Self {
            displacement,
            force,
            stress,
            work: work[0],
        }
    }

    /// Cauchy stress of Gauss point `q`.
    #[inline(always)]
    fn stress(&self, q: usize) -> Tensor<D, T> {
        tensor::filled(|i, j| self.stress[q * D + i][j])
    }
}

/// Makes these a record's displacements, forces and stresses, and adds to its work.
#[inline(always)]
fn keep<const D: usize, const N: usize, const Q: usize, T: Real>(
    record: &mut [T],
    (u, force): (&Nodal<D, N, T>, &Nodal<D, N, T>),
    (stress, work): (&[Tensor<D, T>; Q], T),
) {
    let (vectors, total) = record.as_chunks_mut::<D>();
    let (displacement, rest) = vectors.split_at_mut(N);
    let (last_force, last_stress) = rest.split_at_mut(N);
    displacement.copy_from_slice(u);
    last_force.copy_from_slice(force);
    last_stress.copy_from_slice(stress.as_flattened());
    total[0] += work;
}

impl<const D: usize, const N: usize, const Q: usize> Formulation<D, N, Q> for Incremental {
    const KINEMATICS: Kinematics = Kinematics::Incremental;

    const RECORD: usize = 2 * N * D + Q * D * D + 1;

    #[inline(always)]
    fn respond<T: Real>(
        element: &impl Points<D, N, Q, T>,
        u: &Nodal<D, N, T>,
        record: &mut [T],
    ) -> Nodal<D, N, T> {
        let last = Record::<D, T>::of(N, record);
        let half = u[0][0].constant(0.5);
        let (mut middle, mut step) = (*u, *u);
        for a in 0..N {
            for k in 0..D {
                let last = last.displacement[a][k];
                middle[a][k] = half * (last + u[a][k]);
                step[a][k] = u[a][k] - last;
            }
        }
        let mut force = geometry::zero(u);
        let mut stress = [[[half; D]; D]; Q];
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let increment = current_gradient(&gradients, &middle, &step);
            let added = element.lame().stress(&tensor::symmetric(&increment));
            let added = tensor::scaled(half, &added);
            let turned = rotated(&tensor::sum(&last.stress(q), &added), &increment);
            stress[q] = tensor::sum(&turned, &added);
            let first_piola = first_piola(&stress[q], &gradients, u);
            geometry::subtract_divergence(&mut force, &first_piola, &gradients, volume);
        }
        geometry::balance(&mut force);
        let mut work = half.constant(0.0);
        for a in 0..N {
            for k in 0..D {
                work -= half * (last.force[a][k] + force[a][k]) * step[a][k];
            }
        }
        keep(record, (u, &force), (&stress, work));
        force
    }

    /// σ̇ = C:d with the rate of deformation d.
    #[inline(always)]
    fn force_rate<T: Real>(
        element: &impl Points<D, N, Q, T>,
        u: &Nodal<D, N, T>,
        velocity: &Nodal<D, N, T>,
    ) -> Nodal<D, N, T> {
        let mut force = geometry::zero(u);
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let rate = current_gradient(&gradients, u, velocity);
            let stress = element.lame().stress(&tensor::symmetric(&rate));
            let first_piola = first_piola(&stress, &gradients, u);
            geometry::subtract_divergence(&mut force, &first_piola, &gradients, volume);
        }
        geometry::balance(&mut force);
        force
    }

    #[inline(always)]
    fn strain_energy<T: Real>(
        element: &impl Points<D, N, Q, T>,
        u: &Nodal<D, N, T>,
        record: &mut [T],
    ) -> T {
        <Self as Formulation<D, N, Q>>::respond(element, u, record);
        Record::<D, T>::of(N, record).work
    }

    fn stress(
        element: &Element<D, N, Q>,
        moduli: &Moduli,
        u: &Nodal<D, N>,
        record: &[f64],
    ) -> StressIntegral<D> {
        let mut now = [0.0; MAX_RECORD];
        let now = &mut now[..record.len()];
        now.copy_from_slice(record);
        <Self as Formulation<D, N, Q>>::respond(element, u, now);
        let now = Record::<D>::of(N, now);
        let mut integral = StressIntegral::default();
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let jacobian = tensor::determinant(&deformation_gradient(&gradients, u));
            let kirchhoff = tensor::scaled(jacobian, &now.stress(q));
            let across = moduli.out_of_plane * tensor::trace(&kirchhoff);
            integral.add(volume, jacobian, &kirchhoff, across);
        }
        integral
    }

    fn past(element: &Element<D, N, Q>, moduli: &Moduli, record: &[f64]) -> Option<Past<D>> {
        let record = Record::<D>::of(N, record);
        let volume: f64 = element.volumes.iter().sum();
        let mean = |k: usize, l: usize| {
            let points = element.volumes.iter().enumerate();
            let all = points.map(|(q, share)| share * record.stress[q * D + k][l]);
            all.sum::<f64>() / volume
        };
        let held = |(q, share): (usize, &f64)| share * moduli.energy(&record.stress(q));
        let held: f64 = element.volumes.iter().enumerate().map(held).sum();
        Some(Past {
            stress: tensor::filled(mean),
            excess: record.work - held,
            volume,
        })
    }

    fn set_past(
        element: &Element<D, N, Q>,
        moduli: &Moduli,
        past: &Past<D>,
        u: &Nodal<D, N>,
        record: &mut [f64],
    ) {
        let mut force = [[0.0; D]; N];
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let first_piola = first_piola(&past.stress, &gradients, u);
            geometry::subtract_divergence(&mut force, &first_piola, &gradients, volume);
        }
        geometry::balance(&mut force);
        let volume: f64 = element.volumes.iter().sum();
        let known = Record::<D>::of(N, record).work;
        let work = volume * (past.excess / past.volume + moduli.energy(&past.stress)) - known;
        keep(record, (u, &force), (&[past.stress; Q], work));
    }
}

#[inline(always)]
fn deformation_gradient<const D: usize, const N: usize, T: Real>(
    gradients: &Nodal<D, N, T>,
    u: &Nodal<D, N, T>,
) -> Tensor<D, T> {
    tensor::sum(
        &tensor::identity(u[0][0]),
        &geometry::gradient(gradients, u),
    )
}

/// Gradient of `field` on the configuration displaced by `u`.
#[inline(always)]
fn current_gradient<const D: usize, const N: usize, T: Real>(
    gradients: &Nodal<D, N, T>,
    u: &Nodal<D, N, T>,
    field: &Nodal<D, N, T>,
) -> Tensor<D, T> {
    let (inverse, _) = tensor::inverse(&deformation_gradient(gradients, u));
    tensor::product(&geometry::gradient(gradients, field), &inverse)
}

/// P = J σ F⁻ᵀ on the configuration displaced by `u`.
#[inline(always)]
fn first_piola<const D: usize, const N: usize, T: Real>(
    stress: &Tensor<D, T>,
    gradients: &Nodal<D, N, T>,
    u: &Nodal<D, N, T>,
) -> Tensor<D, T> {
    let (inverse, jacobian) = tensor::inverse(&deformation_gradient(gradients, u));
    let scaled = tensor::scaled(jacobian, stress);
    tensor::product_transposed(&scaled, &inverse)
}

/// Q σ Qᵀ with Q = (I − ½W)⁻¹ (I + ½W), W the skew part of the increment.
#[inline(always)]
fn rotated<const D: usize, T: Real>(
    stress: &Tensor<D, T>,
    increment: &Tensor<D, T>,
) -> Tensor<D, T> {
    let like = increment[0][0];
    let unit: Tensor<D, T> = tensor::identity(like);
    let half = |sign: f64| -> Tensor<D, T> {
        let spin = |i: usize, j: usize| like.constant(0.25) * (increment[i][j] - increment[j][i]);
        tensor::filled(|i, j| unit[i][j] + like.constant(sign) * spin(i, j))
    };
    let (inverse, _) = tensor::inverse(&half(-1.0));
    let rotation = tensor::product(&inverse, &half(1.0));
    tensor::product_transposed(&tensor::product(&rotation, stress), &rotation)
}
