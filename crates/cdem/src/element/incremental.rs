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
/// Work is ½ V (P + P') : ∇Δu, P at rest being first Piola–Kirchhoff stress at the ends: what the
/// nodal forces do on the way.
pub(super) struct Incremental;

/// What an element keeps from kick to kick.
struct Record<const D: usize, const N: usize, const Q: usize, T = f64> {
    /// Displacements relative to that of its first node, m.
    displacement: Nodal<D, N, T>,
    /// Cauchy stress of its Gauss points, Pa; of what is symmetric one half is kept.
    stress: [Tensor<D, T>; Q],
    /// Work done on it, J.
    work: T,
}

impl<const D: usize, const N: usize, const Q: usize, T: Real> Record<D, N, Q, T> {
    /// Where stresses begin, and numbers of one.
    const STRESS: usize = (N - 1) * D;
    const POINT: usize = D * (D + 1) / 2;
    const LENGTH: usize = Self::STRESS + Q * Self::POINT + 1;

    #[inline(always)]
    fn read(numbers: &[T]) -> Self {
        let mut displacement = [[numbers[0].constant(0.0); D]; N];
        for a in 1..N {
            for k in 0..D {
                displacement[a][k] = numbers[(a - 1) * D + k];
            }
        }
        let mut stress = [[[numbers[0]; D]; D]; Q];
        for q in 0..Q {
            stress[q] = tensor::filled(|i, j| numbers[Self::entry(q, i, j)]);
        }
        Self {
            displacement,
            stress,
            work: numbers[Self::LENGTH - 1],
        }
    }

    #[inline(always)]
    fn write(&self, numbers: &mut [T]) {
        for a in 1..N {
            for k in 0..D {
                numbers[(a - 1) * D + k] = self.displacement[a][k];
            }
        }
        for q in 0..Q {
            for i in 0..D {
                for j in i..D {
                    numbers[Self::entry(q, i, j)] = self.stress[q][i][j];
                }
            }
        }
        numbers[Self::LENGTH - 1] = self.work;
    }

    /// Place of a component of the stress of Gauss point `q`.
    #[inline(always)]
    fn entry(q: usize, i: usize, j: usize) -> usize {
        let (i, j) = (i.min(j), i.max(j));
        Self::STRESS + q * Self::POINT + i * (2 * D - i - 1) / 2 + j
    }
}

impl<const D: usize, const N: usize, const Q: usize> Formulation<D, N, Q> for Incremental {
    const KINEMATICS: Kinematics = Kinematics::Incremental;

    const RECORD: usize = Record::<D, N, Q>::LENGTH;

    #[inline(always)]
    fn respond<T: Real>(
        element: &impl Points<D, N, Q, T>,
        u: &Nodal<D, N, T>,
        record: &mut [T],
    ) -> Nodal<D, N, T> {
        let mut own = Record::<D, N, Q, T>::read(record);
        let half = u[0][0].constant(0.5);
        let mut way = *u;
        for a in 0..N {
            for k in 0..D {
                way[a][k] = u[a][k] - own.displacement[a][k];
            }
        }
        let mut force = geometry::zero(u);
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let last = geometry::gradient(&gradients, &own.displacement);
            let step = geometry::gradient(&gradients, &way);
            let middle = tensor::sum(&last, &tensor::scaled(half, &step));
            let now = tensor::sum(&last, &step);
            let increment = tensor::product(&step, &inverse(&middle));
            let added = element.lame().stress(&tensor::symmetric(&increment));
            let added = tensor::scaled(half, &added);
            let before = first_piola(&own.stress[q], &last);
            let turned = rotated(&tensor::sum(&own.stress[q], &added), &increment);
            own.stress[q] = tensor::sum(&turned, &added);
            let after = first_piola(&own.stress[q], &now);
            own.work += half * volume * tensor::contraction(&tensor::sum(&before, &after), &step);
            geometry::subtract_divergence(&mut force, &after, &gradients, volume);
        }
        geometry::balance(&mut force);
        own.displacement = *u;
        own.write(record);
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
            let h = geometry::gradient(&gradients, u);
            let rate = geometry::gradient(&gradients, velocity);
            let rate = tensor::product(&rate, &inverse(&h));
            let stress = element.lame().stress(&tensor::symmetric(&rate));
            let first_piola = first_piola(&stress, &h);
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
        Record::<D, N, Q, T>::read(record).work
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
        let now = Record::<D, N, Q>::read(now);
        let mut integral = StressIntegral::default();
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let h = geometry::gradient(&gradients, u);
            let jacobian = tensor::determinant(&deformation_gradient(&h));
            let kirchhoff = tensor::scaled(jacobian, &now.stress[q]);
            let across = moduli.out_of_plane * tensor::trace(&kirchhoff);
            integral.add(volume, jacobian, &kirchhoff, across);
        }
        integral
    }

    fn past(element: &Element<D, N, Q>, moduli: &Moduli, record: &[f64]) -> Option<Past<D>> {
        let own = Record::<D, N, Q>::read(record);
        let volume: f64 = element.volumes.iter().sum();
        let mean = |k: usize, l: usize| {
            let points = element.volumes.iter().enumerate();
            let all = points.map(|(q, share)| share * own.stress[q][k][l]);
            all.sum::<f64>() / volume
        };
        let held = |(q, share): (usize, &f64)| share * moduli.energy(&own.stress[q]);
        let held: f64 = element.volumes.iter().enumerate().map(held).sum();
        Some(Past {
            stress: tensor::filled(mean),
            excess: own.work - held,
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
        let volume: f64 = element.volumes.iter().sum();
        Record {
            displacement: *u,
            stress: [past.stress; Q],
            work: volume * (past.excess / past.volume + moduli.energy(&past.stress)),
        }
        .write(record);
    }
}

/// F = I + H.
#[inline(always)]
fn deformation_gradient<const D: usize, T: Real>(h: &Tensor<D, T>) -> Tensor<D, T> {
    tensor::sum(&tensor::identity(h[0][0]), h)
}

/// F⁻¹.
#[inline(always)]
fn inverse<const D: usize, T: Real>(h: &Tensor<D, T>) -> Tensor<D, T> {
    tensor::inverse(&deformation_gradient(h)).0
}

/// P = J σ F⁻ᵀ.
#[inline(always)]
fn first_piola<const D: usize, T: Real>(stress: &Tensor<D, T>, h: &Tensor<D, T>) -> Tensor<D, T> {
    tensor::product(stress, &tensor::cofactors(&deformation_gradient(h)))
}

/// Q σ Qᵀ, symmetric as σ is, with Q = (I − ½W)⁻¹ (I + ½W), W the skew part of the increment:
/// I + 2 (½W + ½W·½W)/(1 + w·w), w being the axial vector of ½W.
#[inline(always)]
fn rotated<const D: usize, T: Real>(
    stress: &Tensor<D, T>,
    increment: &Tensor<D, T>,
) -> Tensor<D, T> {
    let like = increment[0][0];
    let half: Tensor<D, T> =
        tensor::filled(|i, j| like.constant(0.25) * (increment[i][j] - increment[j][i]));
    let square = tensor::product(&half, &half);
    let one = like.constant(1.0);
    // w·w = −½ tr (½W)².
    let share = like.constant(2.0) / (one - like.constant(0.5) * tensor::trace(&square));
    let turn = tensor::scaled(share, &tensor::sum(&half, &square));
    let rotation = tensor::sum(&tensor::identity(like), &turn);
    let turned = tensor::product(&rotation, stress);
    tensor::filled(|i, j| {
        let (i, j) = (i.min(j), i.max(j));
        tensor::contracted::<D, T>(|k| turned[i][k] * rotation[j][k])
    })
}
