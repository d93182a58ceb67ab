//! The paper's (2): incremental kinematics with objective rotation of stress.

use super::Past;
use super::geometry::{self, Nodal, View};
use super::set::{Formulation, StressIntegral};
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
pub(super) struct Incremental {
    history: Vec<f64>,
}

/// What an increment adds to an element's record.
pub(super) struct Increment<const D: usize, const Q: usize> {
    stress: [Tensor<D>; Q],
    work: f64,
}

/// A record, cut into its parts.
struct Record<'a, const D: usize> {
    displacement: &'a [[f64; D]],
    force: &'a [[f64; D]],
    stress: &'a [[f64; D]],
    work: f64,
}

const fn record_length<const D: usize, const N: usize, const Q: usize>() -> usize {
    2 * N * D + Q * D * D + 1
}

impl Incremental {
    /// Undeformed, stress-free elements.
    pub(super) fn new<const D: usize, const N: usize, const Q: usize>(count: usize) -> Self {
        Self {
            history: vec![0.0; count * record_length::<D, N, Q>()],
        }
    }

    fn record<const D: usize, const N: usize, const Q: usize>(&self, i: usize) -> Record<'_, D> {
        let length = record_length::<D, N, Q>();
        let (vectors, work) = self.history[i * length..][..length].as_chunks::<D>();
        let (displacement, rest) = vectors.split_at(N);
        let (force, stress) = rest.split_at(N);
        Record {
            displacement,
            force,
            stress,
            work: work[0],
        }
    }
}

impl<const D: usize, const N: usize, const Q: usize> Formulation<D, N, Q> for Incremental {
    type Update = Increment<D, Q>;

    const KINEMATICS: Kinematics = Kinematics::Incremental;

    fn respond(
        &self,
        i: usize,
        element: View<D, N, Q>,
        u: &Nodal<D, N>,
    ) -> (Nodal<D, N>, Increment<D, Q>) {
        let record = self.record::<D, N, Q>(i);
        let (mut middle, mut step) = ([[0.0; D]; N], [[0.0; D]; N]);
        for a in 0..N {
            for k in 0..D {
                let last = record.displacement[a][k];
                middle[a][k] = 0.5 * (last + u[a][k]);
                step[a][k] = u[a][k] - last;
            }
        }
        let mut force = [[0.0; D]; N];
        let mut stress = [[[0.0; D]; D]; Q];
        for (q, (gradients, &volume)) in element.gradients.iter().zip(element.volumes).enumerate() {
            let increment = current_gradient(gradients, &middle, &step);
            let old = tensor::filled(|i, j| record.stress[q * D + i][j]);
            let half = element.moduli.stress(&tensor::symmetric(&increment));
            let half = tensor::scaled(0.5, &half);
            stress[q] = tensor::sum(&rotated(&tensor::sum(&old, &half), &increment), &half);
            let first_piola = first_piola(&stress[q], gradients, u);
            geometry::subtract_divergence(&mut force, &first_piola, gradients, volume);
        }
        geometry::balance(&mut force);
        let mut work = 0.0;
        for a in 0..N {
            for k in 0..D {
                work -= 0.5 * (record.force[a][k] + force[a][k]) * step[a][k];
            }
        }
        (force, Increment { stress, work })
    }

    fn commit(&mut self, i: usize, u: &Nodal<D, N>, force: &Nodal<D, N>, step: Increment<D, Q>) {
        let length = record_length::<D, N, Q>();
        let (vectors, work) = self.history[i * length..][..length].as_chunks_mut::<D>();
        let (displacement, rest) = vectors.split_at_mut(N);
        let (old_force, stress) = rest.split_at_mut(N);
        displacement.copy_from_slice(u);
        old_force.copy_from_slice(force);
        stress.copy_from_slice(step.stress.as_flattened());
        work[0] += step.work;
    }

    /// σ̇ = C:d with the rate of deformation d.
    fn force_rate(element: View<D, N, Q>, u: &Nodal<D, N>, velocity: &Nodal<D, N>) -> Nodal<D, N> {
        let mut force = [[0.0; D]; N];
        for (gradients, &volume) in element.gradients.iter().zip(element.volumes) {
            let rate = current_gradient(gradients, u, velocity);
            let stress = element.moduli.stress(&tensor::symmetric(&rate));
            let first_piola = first_piola(&stress, gradients, u);
            geometry::subtract_divergence(&mut force, &first_piola, gradients, volume);
        }
        geometry::balance(&mut force);
        force
    }

    fn strain_energy(&self, i: usize, element: View<D, N, Q>, u: &Nodal<D, N>) -> f64 {
        self.record::<D, N, Q>(i).work + self.respond(i, element, u).1.work
    }

    fn stress(&self, i: usize, element: View<D, N, Q>, u: &Nodal<D, N>) -> StressIntegral<D> {
        let (_, increment) = self.respond(i, element, u);
        let mut integral = StressIntegral::default();
        for (q, (gradients, &volume)) in element.gradients.iter().zip(element.volumes).enumerate() {
            let jacobian = tensor::determinant(&deformation_gradient(gradients, u));
            let kirchhoff = tensor::scaled(jacobian, &increment.stress[q]);
            let across = element.moduli.out_of_plane * tensor::trace(&kirchhoff);
            integral.add(volume, jacobian, &kirchhoff, across);
        }
        integral
    }

    fn past(&self, i: usize, element: View<D, N, Q>) -> Option<Past<D>> {
        let record = self.record::<D, N, Q>(i);
        let volume: f64 = element.volumes.iter().sum();
        let mean = |k: usize, l: usize| {
            let points = element.volumes.iter().enumerate();
            let all = points.map(|(q, share)| share * record.stress[q * D + k][l]);
            all.sum::<f64>() / volume
        };
        let held = |(q, share): (usize, &f64)| {
            let stress: Tensor<D> = tensor::filled(|k, l| record.stress[q * D + k][l]);
            share * element.moduli.energy(&stress)
        };
        let held: f64 = element.volumes.iter().enumerate().map(held).sum();
        Some(Past {
            stress: tensor::filled(mean),
            excess: record.work - held,
            volume,
        })
    }

    fn set_past(&mut self, i: usize, element: View<D, N, Q>, past: &Past<D>, u: &Nodal<D, N>) {
        let mut force = [[0.0; D]; N];
        for (gradients, &volume) in element.gradients.iter().zip(element.volumes) {
            let first_piola = first_piola(&past.stress, gradients, u);
            geometry::subtract_divergence(&mut force, &first_piola, gradients, volume);
        }
        geometry::balance(&mut force);
        let volume: f64 = element.volumes.iter().sum();
        let known = self.record::<D, N, Q>(i).work;
        let past = Increment {
            stress: [past.stress; Q],
            work: volume * (past.excess / past.volume + element.moduli.energy(&past.stress))
                - known,
        };
        self.commit(i, u, &force, past);
    }

    fn history(&self) -> &[f64] {
        &self.history
    }

    fn history_mut(&mut self) -> &mut [f64] {
        &mut self.history
    }
}

fn deformation_gradient<const D: usize, const N: usize>(
    gradients: &Nodal<D, N>,
    u: &Nodal<D, N>,
) -> Tensor<D> {
    tensor::sum(&tensor::identity(), &geometry::gradient(gradients, u))
}

/// Gradient of `field` on the configuration displaced by `u`.
fn current_gradient<const D: usize, const N: usize>(
    gradients: &Nodal<D, N>,
    u: &Nodal<D, N>,
    field: &Nodal<D, N>,
) -> Tensor<D> {
    let (inverse, _) = tensor::inverse(&deformation_gradient(gradients, u));
    tensor::product(&geometry::gradient(gradients, field), &inverse)
}

/// P = J σ F⁻ᵀ on the configuration displaced by `u`.
fn first_piola<const D: usize, const N: usize>(
    stress: &Tensor<D>,
    gradients: &Nodal<D, N>,
    u: &Nodal<D, N>,
) -> Tensor<D> {
    let (inverse, jacobian) = tensor::inverse(&deformation_gradient(gradients, u));
    let scaled = tensor::scaled(jacobian, stress);
    tensor::product_transposed(&scaled, &inverse)
}

/// Q σ Qᵀ with Q = (I − ½W)⁻¹ (I + ½W), W the skew part of the increment.
fn rotated<const D: usize>(stress: &Tensor<D>, increment: &Tensor<D>) -> Tensor<D> {
    let half = |sign: f64| -> Tensor<D> {
        let spin = |i: usize, j: usize| 0.25 * (increment[i][j] - increment[j][i]);
        let unit = tensor::identity::<D>();
        tensor::filled(|i, j| unit[i][j] + sign * spin(i, j))
    };
    let (inverse, _) = tensor::inverse(&half(-1.0));
    let rotation = tensor::product(&inverse, &half(1.0));
    tensor::product_transposed(&tensor::product(&rotation, stress), &rotation)
}
