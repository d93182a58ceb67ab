//! What elements are at rest: gradients, volumes, masses, stiffness.

use std::sync::Arc;

use super::lanes::{Lanes, MOST, Real};
use super::shape::{self, Point};
use super::tensor::{self, Tensor};
use crate::material::Elastic;
use crate::mesh::{Element, ElementKind};
use crate::scene::Plane;

/// Values or vectors at the nodes of an element.
pub(super) type Nodal<const D: usize, const N: usize, T = f64> = [[T; D]; N];

/// Lamé's moduli, of one element or several.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lame<T> {
    /// λ between in-plane stress and strain (3-D: λ), Pa.
    pub(super) lambda: T,
    /// Shear modulus, Pa.
    pub(super) mu: T,
}

impl<T: Real> Lame<T> {
    /// C : strain, for a symmetric strain or strain rate.
    #[inline(always)]
    pub(super) fn stress<const D: usize>(&self, strain: &Tensor<D, T>) -> Tensor<D, T> {
        let pressure = self.lambda * tensor::trace(strain);
        let mut stress = tensor::scaled(self.mu.constant(2.0) * self.mu, strain);
        for i in 0..D {
            stress[i][i] += pressure;
        }
        stress
    }
}

/// A material as the kernels use it.
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

    /// ½ stress : C⁻¹ : stress, J/m³.
    pub(super) fn energy<const D: usize>(&self, stress: &Tensor<D>) -> f64 {
        let square = tensor::contraction(stress, stress);
        let Lame { lambda, mu } = self.lame;
        let share = lambda / (D as f64 * lambda + 2.0 * mu);
        (square - share * tensor::trace(stress).powi(2)) / (4.0 * mu)
    }
}

/// Elements of one shape at rest, as arrays.
pub(super) struct Geometry<const D: usize, const N: usize, const Q: usize> {
    kind: ElementKind,
    mesh_elements: Vec<u32>,
    nodes: Vec<[u32; N]>,
    gradients: Vec<[Nodal<D, N>; Q]>,
    volumes: Vec<[f64; Q]>,
    material: Vec<u32>,
    moduli: Arc<[Moduli]>,
    rest: Arc<[[f64; D]]>,
    thickness: f64,
}

/// One element, or several side by side: gradients of its shape functions and volume (m³)
/// at its Gauss points, and its material.
#[derive(Clone, Copy)]
pub(super) struct View<'a, const D: usize, const N: usize, const Q: usize, T = f64> {
    pub(super) gradients: &'a [Nodal<D, N, T>; Q],
    pub(super) volumes: &'a [T; Q],
    pub(super) lame: Lame<T>,
}

/// Elements side by side.
pub(super) struct Gathered<const D: usize, const N: usize, const Q: usize, T> {
    gradients: [Nodal<D, N, T>; Q],
    volumes: [T; Q],
    lame: Lame<T>,
}

impl<const D: usize, const N: usize, const Q: usize, T: Copy> Gathered<D, N, Q, T> {
    #[inline(always)]
    pub(super) fn view(&self) -> View<'_, D, N, Q, T> {
        View {
            gradients: &self.gradients,
            volumes: &self.volumes,
            lame: self.lame,
        }
    }
}

impl<const D: usize, const N: usize, const Q: usize> Geometry<D, N, Q> {
    /// `members` are (number in `elements`, material), ascending; `weight` is the share of
    /// its volume that an element stands for.
    pub(super) fn new(
        kind: ElementKind,
        elements: &[Element],
        weight: impl Fn(u32) -> f64,
        members: &[(u32, u32)],
        rest: Arc<[[f64; D]]>,
        moduli: Arc<[Moduli]>,
        thickness: f64,
    ) -> Self {
        let rule = shape::stiffness_rule(kind);
        let mut geometry = Self {
            kind,
            mesh_elements: members.iter().map(|m| m.0).collect(),
            nodes: Vec::with_capacity(members.len()),
            gradients: Vec::with_capacity(members.len()),
            volumes: Vec::with_capacity(members.len()),
            material: members.iter().map(|m| m.1).collect(),
            moduli,
            rest,
            thickness,
        };
        for &(element, _) in members {
            let all = elements[element as usize].nodes;
            let nodes = std::array::from_fn(|a| all[a]);
            let at = |q: usize| geometry.map_point(&nodes, rule[q]);
            let points: [MappedPoint<D, N>; Q] = std::array::from_fn(at);
            geometry.nodes.push(nodes);
            geometry
                .gradients
                .push(points.each_ref().map(|p| p.gradients));
            let weight = weight(element);
            geometry
                .volumes
                .push(points.each_ref().map(|p| weight * p.volume));
        }
        geometry
    }

    pub(super) fn mesh_elements(&self) -> &[u32] {
        &self.mesh_elements
    }

    #[inline]
    pub(super) fn nodes(&self, i: usize) -> &[u32; N] {
        &self.nodes[i]
    }

    #[inline]
    pub(super) fn view(&self, i: usize) -> View<'_, D, N, Q> {
        View {
            gradients: &self.gradients[i],
            volumes: &self.volumes[i],
            lame: self.moduli(i).lame,
        }
    }

    /// Material of element `i`.
    #[inline]
    pub(super) fn moduli(&self, i: usize) -> &Moduli {
        &self.moduli[self.material[i] as usize]
    }

    /// `field` at the nodes of some elements side by side, less that of their first nodes.
    #[inline(always)]
    pub(super) fn relative<L: Lanes>(
        &self,
        lanes: L,
        elements: &[u32],
        field: &[[f64; D]],
    ) -> Nodal<D, N, L::Number> {
        let mut all = [[[0.0; MOST]; D]; N];
        for lane in 0..L::COUNT {
            let nodes = &self.nodes[elements[lane] as usize];
            let first = field[nodes[0] as usize];
            for a in 0..N {
                let own = &field[nodes[a] as usize];
                for k in 0..D {
                    all[a][k][lane] = own[k] - first[k];
                }
            }
        }
        all.map(|of_node| of_node.map(|component| lanes.load(&component)))
    }

    /// What the kernels need of some elements side by side.
    #[inline(always)]
    pub(super) fn gather<L: Lanes>(
        &self,
        lanes: L,
        elements: &[u32],
    ) -> Gathered<D, N, Q, L::Number> {
        let element = |lane: usize| elements[lane.min(L::COUNT - 1)] as usize;
        let lame: [Lame<f64>; MOST] = std::array::from_fn(|lane| self.moduli(element(lane)).lame);
        let lame = Lame {
            lambda: lanes.gather(|lane| lame[lane].lambda),
            mu: lanes.gather(|lane| lame[lane].mu),
        };
        let gradients: [_; MOST] = std::array::from_fn(|lane| &self.gradients[element(lane)]);
        let volumes: [_; MOST] = std::array::from_fn(|lane| &self.volumes[element(lane)]);
        let mut gathered = Gathered {
            gradients: [[[lame.mu; D]; N]; Q],
            volumes: [lame.mu; Q],
            lame,
        };
        for q in 0..Q {
            gathered.volumes[q] = lanes.gather(|lane| volumes[lane][q]);
            // That of the first node is minus the sum of the others, and not asked for.
            for a in 1..N {
                for k in 0..D {
                    gathered.gradients[q][a][k] = lanes.gather(|lane| gradients[lane][q][a][k]);
                }
            }
        }
        gathered
    }

    /// Bytes per element.
    pub(super) const fn memory() -> usize {
        size_of::<u32>() * (2 + N) + size_of::<f64>() * Q * (1 + N * D)
    }

    /// ∫ρ N_a N_b of element `i`, kg.
    pub(super) fn consistent_mass(&self, i: usize) -> [[f64; N]; N] {
        let mut mass = [[0.0; N]; N];
        let density = self.moduli(i).density;
        for point in shape::mass_rule(self.kind) {
            let mapped = self.map_point(&self.nodes[i], point);
            for (row, value) in mass.iter_mut().zip(mapped.values) {
                for (entry, other) in row.iter_mut().zip(mapped.values) {
                    *entry += density * mapped.volume * value * other;
                }
            }
        }
        mass
    }

    /// ∫ρ N_a of element `i`, kg.
    pub(super) fn lumped_mass(&self, i: usize) -> [f64; N] {
        let (volumes, density) = (&self.volumes[i], self.moduli(i).density);
        let mut mass = [0.0; N];
        for (point, volume) in shape::stiffness_rule(self.kind).iter().zip(volumes) {
            let values = shape::shape(self.kind, point.position).values;
            for (share, value) in mass.iter_mut().zip(values) {
                *share += density * volume * value;
            }
        }
        mass
    }

    fn map_point(&self, nodes: &[u32; N], point: Point) -> MappedPoint<D, N> {
        let shape = shape::shape(self.kind, point.position);
        let origin = self.rest[nodes[0] as usize];
        let mut jacobian: Tensor<D> = [[0.0; D]; D];
        for (node, reference) in nodes.iter().zip(shape.gradients) {
            let position = self.rest[*node as usize];
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
    gradients: Nodal<D, N>,
    volume: f64,
}

impl<const D: usize, const N: usize, const Q: usize> View<'_, D, N, Q> {
    /// Entry of the stiffness at rest between component `k` of node `a` and
    /// component `l` of node `b`, N/m.
    pub(super) fn stiffness(&self, (a, k): (usize, usize), (b, l): (usize, usize)) -> f64 {
        let Lame { lambda, mu } = self.lame;
        let at = |(gradients, volume): (&Nodal<D, N>, &f64)| {
            let (ga, gb) = (gradients[a], gradients[b]);
            let mut entry = lambda * ga[k] * gb[l] + mu * ga[l] * gb[k];
            if k == l {
                entry += mu * (0..D).map(|j| ga[j] * gb[j]).sum::<f64>();
            }
            volume * entry
        };
        self.gradients.iter().zip(self.volumes).map(at).sum()
    }
}

/// Σ (v_a − v_0) ⊗ ∇N_a, `relative` being v_a − v_0.
#[inline(always)]
pub(super) fn gradient<const D: usize, const N: usize, T: Real>(
    gradients: &Nodal<D, N, T>,
    relative: &Nodal<D, N, T>,
) -> Tensor<D, T> {
    let mut result = [[relative[1][0].constant(0.0); D]; D];
    for a in 1..N {
        for i in 0..D {
            for j in 0..D {
                result[i][j] += relative[a][i] * gradients[a][j];
            }
        }
    }
    result
}

/// Nothing at any node, in numbers like others.
#[inline(always)]
pub(super) fn zero<const D: usize, const N: usize, T: Real>(
    like: &Nodal<D, N, T>,
) -> Nodal<D, N, T> {
    [[like[0][0].constant(0.0); D]; N]
}

/// Subtracts `volume`·P·∇N_a from the force of all nodes but the first.
#[inline(always)]
pub(super) fn subtract_divergence<const D: usize, const N: usize, T: Real>(
    force: &mut Nodal<D, N, T>,
    first_piola: &Tensor<D, T>,
    gradients: &Nodal<D, N, T>,
    volume: T,
) {
    let scaled = tensor::scaled(volume, first_piola);
    for a in 1..N {
        for i in 0..D {
            for j in 0..D {
                force[a][i] -= scaled[i][j] * gradients[a][j];
            }
        }
    }
}

/// Gives the first node minus the sum of the others.
#[inline(always)]
pub(super) fn balance<const D: usize, const N: usize, T: Real>(force: &mut Nodal<D, N, T>) {
    for i in 0..D {
        let mut sum = force[1][i];
        for a in 2..N {
            sum += force[a][i];
        }
        force[0][i] = -sum;
    }
}
