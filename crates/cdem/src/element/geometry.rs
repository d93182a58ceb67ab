//! Elements at rest: gradients, volumes, masses, stiffness.

use crate::element::material::Elastic;
use crate::element::shape::{self, QuadraturePoint};
use crate::element::simd::Real;
use crate::element::tensor::{self, Tensor};
use crate::mesh::ElementKind;
use crate::scene::Plane;

/// Values or vectors at the nodes of an element.
pub(super) type NodalValues<const D: usize, const N: usize, T = f64> = [[T; D]; N];

/// Lamé's moduli of one element or several.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lame<T> {
    /// λ between in-plane stress and strain (3-D: λ), Pa.
    pub(super) lambda: T,
    /// Shear modulus, Pa.
    pub(super) mu: T,
}

impl<T: Real> Lame<T> {
    /// Returns C : strain, for a symmetric strain or strain rate.
    #[inline(always)]
    pub(super) fn stress<const D: usize>(&self, strain: &Tensor<D, T>) -> Tensor<D, T> {
        let pressure = self.lambda * tensor::trace(strain);
        let mut stress = tensor::scaled(self.mu.constant(2.0) * self.mu, strain);
        for i in 0..D {
            stress[i][i] += pressure;
        }
        stress
    }

    /// Returns C : sym(a).
    #[inline(always)]
    pub(super) fn stress_of<const D: usize>(&self, a: &Tensor<D, T>) -> Tensor<D, T> {
        let pressure = self.lambda * tensor::trace(a);
        let mut stress = tensor::filled(|i, j| self.mu * (a[i][j] + a[j][i]));
        for i in 0..D {
            stress[i][i] += pressure;
        }
        stress
    }
}

/// Constants of a material for the kernels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moduli {
    pub(super) lame: Lame<f64>,
    /// σ_zz over σ_xx + σ_yy in 2-D: ν in plane strain, 0 in plane stress.
    pub(super) out_of_plane: f64,
    /// Stiffness-proportional damping β, s.
    pub(super) damping: f64,
    /// Density, kg/m³.
    pub(super) density: f64,
}

impl Moduli {
    pub(super) fn new<const D: usize>(material: &Elastic, plane: Plane) -> Self {
        let (lambda, mu) = (material.lame_lambda, material.shear_modulus);
        let stress = D == 2 && plane == Plane::Stress;
        Self {
            lame: Lame {
                lambda: if stress {
                    material.in_plane_lambda(plane)
                } else {
                    lambda
                },
                mu,
            },
            out_of_plane: if stress {
                0.0
            } else {
                0.5 * lambda / (lambda + mu)
            },
            damping: material.damping.stiffness,
            density: material.density,
        }
    }

    /// Returns ½ stress : C⁻¹ : stress, J/m³.
    pub(super) fn energy<const D: usize>(&self, stress: &Tensor<D>) -> f64 {
        let square = tensor::contraction(stress, stress);
        let Lame { lambda, mu } = self.lame;
        let share = lambda / (D as f64 * lambda + 2.0 * mu);
        (square - share * tensor::trace(stress).powi(2)) / (4.0 * mu)
    }
}

/// An element: gradients of its shape functions and volume (m³) at its Gauss points, and its
/// material.
#[derive(Clone, Copy, Debug)]
pub(super) struct ElementGeometry<const D: usize, const N: usize, const Q: usize> {
    pub(super) gradients: [NodalValues<D, N>; Q],
    pub(super) volumes: [f64; Q],
    pub(super) lame: Lame<f64>,
}

/// Data of an element, or of several in SIMD lanes, that the formulations need.
pub(super) trait IntegrationPoints<const D: usize, const N: usize, const Q: usize, T> {
    fn lame(&self) -> Lame<T>;

    /// Returns the gradients of the shape functions, 1/m, and the volume, m³, of Gauss point `q`.
    fn point(&self, q: usize) -> (NodalValues<D, N, T>, T);
}

impl<const D: usize, const N: usize, const Q: usize> IntegrationPoints<D, N, Q, f64>
    for ElementGeometry<D, N, Q>
{
    fn lame(&self) -> Lame<f64> {
        self.lame
    }

    fn point(&self, q: usize) -> (NodalValues<D, N>, f64) {
        (self.gradients[q], self.volumes[q])
    }
}

/// An undeformed element.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReferenceElement<const D: usize, const N: usize> {
    pub(super) kind: ElementKind,
    /// Positions of its nodes, m.
    pub(super) at: [[f64; D]; N],
    /// Thickness, m; 1 in 3-D.
    pub(super) thickness: f64,
}

impl<const D: usize, const N: usize> ReferenceElement<D, N> {
    /// Returns the geometry for the kernels; `weight` is a factor on its volume.
    pub(super) fn element<const Q: usize>(
        &self,
        weight: f64,
        lame: Lame<f64>,
    ) -> ElementGeometry<D, N, Q> {
        let rule = shape::stiffness_rule(self.kind);
        let points: [MappedPoint<D, N>; Q] = std::array::from_fn(|q| self.map(rule[q]));
        ElementGeometry {
            gradients: points.each_ref().map(|point| point.gradients),
            volumes: points.each_ref().map(|point| weight * point.volume),
            lame,
        }
    }

    /// Returns ∫ρ N_a N_b, kg.
    pub(super) fn consistent_mass(&self, density: f64) -> [[f64; N]; N] {
        let mut mass = [[0.0; N]; N];
        for point in shape::mass_rule(self.kind) {
            let mapped = self.map(point);
            for (row, value) in mass.iter_mut().zip(mapped.values) {
                for (entry, other) in row.iter_mut().zip(mapped.values) {
                    *entry += density * mapped.volume * value * other;
                }
            }
        }
        mass
    }

    fn map(&self, point: QuadraturePoint) -> MappedPoint<D, N> {
        let shape = shape::shape(self.kind, point.position);
        let origin = self.at[0];
        let mut jacobian: Tensor<D> = [[0.0; D]; D];
        for (position, reference) in self.at.iter().zip(shape.gradients) {
            for i in 0..D {
                for j in 0..D {
                    jacobian[i][j] += (position[i] - origin[i]) * reference[j];
                }
            }
        }
        let (inverse, determinant) = tensor::inverse(&jacobian);
        let gradient = |a: usize| {
            let reference = shape.gradients[a];
            std::array::from_fn(|j| (0..D).map(|k| reference[k] * inverse[k][j]).sum())
        };
        MappedPoint {
            values: std::array::from_fn(|a| shape.values[a]),
            gradients: std::array::from_fn(gradient),
            volume: point.weight * determinant * self.thickness,
        }
    }
}

/// A quadrature point mapped onto an element at rest.
struct MappedPoint<const D: usize, const N: usize> {
    values: [f64; N],
    gradients: NodalValues<D, N>,
    volume: f64,
}

impl<const D: usize, const N: usize, const Q: usize> ElementGeometry<D, N, Q> {
    /// Returns ∫ρ N_a, kg.
    pub(super) fn lumped_mass(&self, kind: ElementKind, density: f64) -> [f64; N] {
        let mut mass = [0.0; N];
        for (point, volume) in shape::stiffness_rule(kind).iter().zip(self.volumes) {
            let values = shape::shape(kind, point.position).values;
            for (share, value) in mass.iter_mut().zip(values) {
                *share += density * volume * value;
            }
        }
        mass
    }

    /// Returns the entry of the stiffness at rest between two degrees of freedom, N/m. They are
    /// numbered node by node, the components of a node together.
    pub(super) fn stiffness(&self, row: usize, column: usize) -> f64 {
        let Lame { lambda, mu } = self.lame;
        let (a, k) = (row / D, row % D);
        let (b, l) = (column / D, column % D);
        let at = |(gradients, volume): (&NodalValues<D, N>, &f64)| {
            let (ga, gb) = (gradients[a], gradients[b]);
            let mut entry = lambda * ga[k] * gb[l] + mu * ga[l] * gb[k];
            if k == l {
                entry += mu * (0..D).map(|j| ga[j] * gb[j]).sum::<f64>();
            }
            volume * entry
        };
        self.gradients.iter().zip(&self.volumes).map(at).sum()
    }
}

/// Returns Σ (v_a − v_0) ⊗ ∇N_a; `relative` is v_a − v_0.
#[inline(always)]
pub(super) fn gradient<const D: usize, const N: usize, T: Real>(
    gradients: &NodalValues<D, N, T>,
    relative: &NodalValues<D, N, T>,
) -> Tensor<D, T> {
    let mut result: Tensor<D, T> = tensor::filled(|i, j| relative[1][i] * gradients[1][j]);
    for a in 2..N {
        for i in 0..D {
            for j in 0..D {
                result[i][j] += relative[a][i] * gradients[a][j];
            }
        }
    }
    result
}

/// Returns −0 at every node, in the number type of `like`. Compilers need not add −0.
#[inline(always)]
pub(super) fn nothing<const D: usize, const N: usize, T: Real>(
    like: &NodalValues<D, N, T>,
) -> NodalValues<D, N, T> {
    [[like[0][0].constant(-0.0); D]; N]
}

/// Subtracts `volume`·P·∇N_a from the force of all nodes but the first.
#[inline(always)]
pub(super) fn subtract_divergence<const D: usize, const N: usize, T: Real>(
    force: &mut NodalValues<D, N, T>,
    first_piola: &Tensor<D, T>,
    gradients: &NodalValues<D, N, T>,
    volume: T,
) {
    let scaled = tensor::scaled(-volume, first_piola);
    for a in 1..N {
        for i in 0..D {
            for j in 0..D {
                force[a][i] += scaled[i][j] * gradients[a][j];
            }
        }
    }
}

/// Sets the force of the first node to minus the sum of the others.
#[inline(always)]
pub(super) fn balance<const D: usize, const N: usize, T: Real>(force: &mut NodalValues<D, N, T>) {
    for i in 0..D {
        let mut sum = force[1][i];
        for a in 2..N {
            sum += force[a][i];
        }
        force[0][i] = -sum;
    }
}
