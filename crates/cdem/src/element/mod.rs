//! Finite elements: internal forces, stress, masses and stable steps.
//!
//! Elements of one shape and one kinematic formulation form an [`ElementSet`]; [`build`] sorts the
//! elements of a mesh into such sets. The step loop uses only the trait.
//!
//! Deformation is measured from displacements, F = I + Σ (u_a − u_0) ⊗ ∇N_a, and the force on the
//! first node of an element is minus the sum of the others. So a body far from the origin loses no
//! digits, and the impulses of each element add up to zero to round-off.

pub(crate) mod batch;
pub(crate) mod chunk;
pub(crate) mod critical_step;
pub(crate) mod element_set;
pub(crate) mod evaluate;
pub(crate) mod gather_scatter;
pub(crate) mod geometry;
pub(crate) mod hypoelastic;
pub(crate) mod internal_force;
pub(crate) mod mass;
pub(crate) mod material;
pub(crate) mod numbering;
pub(crate) mod op_count;
pub(crate) mod prefetch;
pub(crate) mod shape;
pub(crate) mod simd;
pub(crate) mod tensor;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod total_lagrangian;

use crate::element::element_set::{FormulationSet, SetSource};
use crate::element::geometry::Moduli;
use crate::element::hypoelastic::Hypoelastic;
use crate::element::material::Elastic;
use crate::element::total_lagrangian::TotalLagrangian;
use crate::mesh::{ElementKind, Mesh};
use crate::scene::{Kinematics, Plane};

pub(crate) use crate::element::critical_step::{highest_frequency, stable_step};
pub(crate) use crate::element::internal_force::GroupImpulses;
pub(crate) use crate::element::numbering::ElementNumbering;

/// Largest number of nodes of an element: a hexahedron's.
pub(crate) const MAX_NODES: usize = 8;

/// Material and kinematics of the elements of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockProperties {
    /// Index of its material.
    pub material: usize,
    /// Kinematic formulation.
    pub kinematics: Kinematics,
}

/// Extremes of the deformation over the Gauss points of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Deformation {
    /// Smallest det F. If it is not positive, the element is inverted.
    pub min_jacobian: f64,
    /// Smallest principal stretch in the dimensions of the mesh.
    pub min_stretch: f64,
    /// Largest principal stretch in the dimensions of the mesh.
    pub max_stretch: f64,
}

/// Stress history of an element with incremental kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StressHistory<const D: usize> {
    /// Cauchy stress, averaged over the volume at rest, Pa.
    pub(crate) stress: [[f64; D]; D],
    /// Work done on the element minus the elastic energy of its stresses, J. The deviation of the
    /// stress from the mean is dropped together with its energy.
    pub(crate) excess: f64,
    /// Volume at rest, m³.
    pub(crate) volume: f64,
}

impl<const D: usize> StressHistory<D> {
    /// Returns the history of several elements together.
    pub(crate) fn of_all(parts: &[Self]) -> Option<Self> {
        let volume: f64 = parts.iter().map(|part| part.volume).sum();
        let mean = |k: usize, l: usize| {
            let all = parts.iter().map(|part| part.volume * part.stress[k][l]);
            all.sum::<f64>() / volume
        };
        (!parts.is_empty()).then(|| Self {
            stress: std::array::from_fn(|k| std::array::from_fn(|l| mean(k, l))),
            excess: parts.iter().map(|part| part.excess).sum(),
            volume,
        })
    }
}

/// The elements that are due in a kick, and its interval.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Due<'a> {
    /// The coarsest level that is due.
    pub(crate) coarsest: u8,
    /// Interval of the kick.
    pub(crate) interval: Interval<'a>,
    /// True if the kick updates the records of the elements. A report must not change it.
    pub(crate) updates_records: bool,
}

/// Interval of a kick, s.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Interval<'a> {
    /// One interval for each level.
    OfLevel(&'a [f64]),
    /// One interval for each element of the mesh.
    OfElement(&'a [f64]),
}

/// A vector at each node of an element. The entries beyond its nodes are zero.
pub(crate) type PaddedNodal<const D: usize> = [[f64; D]; MAX_NODES];

/// The nodes of a group of elements.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GroupNodes<'a> {
    /// Level of its elements; `None`: never due.
    pub(crate) level: Option<u8>,
    /// Nodes in the mesh, ascending.
    pub(crate) nodes: &'a [u32],
}

/// Elements of one shape and one kinematic formulation, as arrays.
///
/// `i` is an index within the set. Displacements and velocities are those of all nodes of the mesh.
/// Gauss points and weights are fixed at rest; 2-D volumes include the thickness. Indices out of
/// range panic.
///
/// Elements of one level near each other form a group. They are kicked together, and the group
/// gives each of its nodes one impulse.
pub(crate) trait ElementSet<const D: usize>: Send + Sync {
    /// Returns the formulation of the elements.
    fn kinematics(&self) -> Kinematics;

    /// Returns the number of elements.
    fn len(&self) -> usize;

    /// Returns the index in [`Mesh::elements`] of each element, ascending.
    fn mesh_elements(&self) -> &[u32];

    /// Returns the nodes of element `i`; `mesh` is the mesh of the set.
    fn nodes<'a>(&self, mesh: &'a Mesh<D>, i: usize) -> &'a [u32] {
        mesh.elements[self.mesh_elements()[i] as usize].nodes()
    }

    /// Sorts the elements into groups by `levels`, one for each element of the mesh. Elements without a
    /// level are never due. At first all elements have level 0.
    fn arrange(&mut self, levels: &[Option<u8>]);

    /// Returns level and nodes of each group, in the order of [`GroupImpulses`].
    fn groups(&self) -> Vec<GroupNodes<'_>>;

    /// Writes the impulses of the due groups to `group_impulses`: the sums of interval·f over their
    /// elements, N·s, where f is the internal nodal force (minus the energy gradient, N). Updates
    /// the records of the elements to the displacements (incremental kinematics: stress is rotated
    /// and updated, work is summed).
    ///
    /// With stiffness-proportional damping β the impulse of the viscous stress β·C:(strain rate)
    /// goes to the second array of `group_impulses`. `motion` is displacements, m, and velocities,
    /// m/s.
    fn kick(&mut self, due: &Due, motion: [&[[f64; D]]; 2], group_impulses: GroupImpulses<D>);

    /// Updates the record of element `i` to `displacement`.
    fn update_record(&mut self, i: usize, displacement: &[[f64; D]]);

    /// Returns the strain energy of element `i`, J. Incremental kinematics: the work done on it up
    /// to its last kick and from there straight to `displacement`.
    fn strain_energy(&self, i: usize, displacement: &[[f64; D]]) -> f64;

    /// Adds the strain energies of the elements to `sum`, J, element by element in the order of the
    /// groups. `is_counted` says, for each element of the mesh, if it counts.
    fn add_strain_energies(&self, displacement: &[[f64; D]], is_counted: &[bool], sum: &mut f64);

    /// Writes the Cauchy stress of every element of the set to `stresses`, which has one entry for
    /// each element of the mesh. The stress is averaged over the current volume: xx yy zz xy yz zx,
    /// Pa. In 2-D it includes zz of plane strain.
    fn stresses(&self, displacement: &[[f64; D]], stresses: &mut [[f64; 6]]);

    /// Returns the nodal forces of element `i`, N. The record does not change.
    fn force(&self, i: usize, displacement: &[[f64; D]]) -> PaddedNodal<D>;

    /// Returns the rate of change of the nodal forces by strain rates, −K·v, N/s, for velocities v
    /// of the nodes of the element.
    fn force_rate(
        &self,
        i: usize,
        displacement: &[[f64; D]],
        velocity: &PaddedNodal<D>,
    ) -> PaddedNodal<D>;

    /// Returns the mesh index of every element that is inverted or strained by more than `most`, in
    /// no order. `most` is at most 0.1. The strain is the norm of Green's strain at all Gauss points
    /// together. In all other elements every principal stretch is within √(1 ± 2 most).
    fn strained(&self, displacement: &[[f64; D]], most: f64) -> Vec<u32>;

    /// Returns the extremes of the deformation of element `i`.
    fn deformation(&self, i: usize, displacement: &[[f64; D]]) -> Deformation;

    /// Returns the highest angular frequency of element `i` alone, rad/s. It is exact for its
    /// stiffness at rest and its own row-sum masses times `mass_factor` of the nodes (one for each
    /// node of the mesh). The highest of all elements bounds that of the assembled mesh (Irons
    /// 1970).
    fn frequency(&self, i: usize, mass_factor: &[f64]) -> f64;

    /// Returns the highest angular frequency of element `i` alone with its consistent mass matrix,
    /// rad/s.
    fn consistent_frequency(&self, i: usize, mesh: &Mesh<D>) -> f64;

    /// Writes the row sums of the mass matrix of element `i`, kg, to the first N entries of `out`,
    /// one for each of its N nodes.
    fn lumped_mass(&self, i: usize, out: &mut [f64]);

    /// Writes the consistent mass matrix of element `i`, ∫ρ N_a N_b, kg, to the first N² entries of
    /// `out`: N×N, row by row.
    fn consistent_mass(&self, i: usize, mesh: &Mesh<D>, out: &mut [f64]);

    /// Writes the stiffness of element `i` at rest, N/m, to the first (N·D)² entries of `out`:
    /// (N·D)×(N·D), row by row, the components of a node together.
    fn stiffness(&self, i: usize, out: &mut [f64]);

    /// Returns the number of numbers that an element stores from kick to kick.
    fn record_length(&self) -> usize;

    /// Returns the numbers that element `i` stores from kick to kick; none for a formulation
    /// without record.
    fn record(&self, i: usize) -> Vec<f64>;

    /// Sets the stored numbers of element `i` to those of the same element of another set.
    fn set_record(&mut self, i: usize, record: &[f64]);

    /// Returns the stress history of element `i` up to its last kick, if the formulation has one.
    fn stress_history(&self, i: usize) -> Option<StressHistory<D>>;

    /// Sets the stress history of element `i` from `past`, the history of an element, or of a part
    /// of one, with the same deformation. The excess work is scaled by the volume.
    fn set_stress_history(&mut self, i: usize, past: &StressHistory<D>, displacement: &[[f64; D]]);

    /// Returns the memory of all elements, bytes.
    fn memory(&self) -> usize;

    /// Returns the bytes that a kick of an element reads or writes, without nodal data, and its
    /// number of operations. Damping is left out.
    fn update_cost(&self) -> [usize; 2];
}

/// Sorts the elements of `mesh` into sets, one for each shape and formulation in use. Shapes come
/// in the order of [`ElementKind`], `TotalLagrangian` first.
///
/// `properties` has one entry for each block of the mesh; `plane` and `thickness` (m) matter in 2-D
/// only.
///
/// # Panics
/// If an element does not have dimension `D`, or `properties` or `materials` are too short: the
/// caller checks its input.
#[must_use]
pub(crate) fn build<const D: usize>(
    mesh: &Mesh<D>,
    properties: &[BlockProperties],
    materials: &[Elastic],
    plane: Plane,
    thickness: f64,
) -> Vec<Box<dyn ElementSet<D>>> {
    let moduli: Vec<Moduli> = materials
        .iter()
        .map(|material| Moduli::new::<D>(material, plane))
        .collect();
    let kinds = [
        ElementKind::Tri3,
        ElementKind::Quad4,
        ElementKind::Tet4,
        ElementKind::Wedge6,
        ElementKind::Hex8,
    ];
    let mut sets = Vec::new();
    for kind in kinds {
        for kinematics in [Kinematics::Total, Kinematics::Incremental] {
            let members = members(mesh, properties, kind, kinematics);
            if members.is_empty() {
                continue;
            }
            assert_eq!(kind.dimension(), D, "a {} in {D}-D", kind.name());
            let source = SetSource {
                kind,
                members: &members,
                moduli: &moduli,
                mesh,
                thickness: if D == 2 { thickness } else { 1.0 },
            };
            sets.push(if const { D == 2 } {
                plane_set(&source, kinematics)
            } else {
                solid_set(&source, kinematics)
            });
        }
    }
    sets
}

/// Returns the elements of the mesh in a future set, with their materials.
fn members<const D: usize>(
    mesh: &Mesh<D>,
    properties: &[BlockProperties],
    kind: ElementKind,
    kinematics: Kinematics,
) -> Vec<(u32, u32)> {
    let mut members = Vec::new();
    for (block, properties) in mesh.blocks.iter().zip(properties) {
        if properties.kinematics == kinematics {
            let of_kind = |&e: &u32| mesh.elements[e as usize].kind == kind;
            let elements = block.elements.clone().filter(of_kind);
            members.extend(elements.map(|e| (e, properties.material as u32)));
        }
    }
    members
}

// The kernels of a shape are compiled for its own dimension alone: `build` chooses by a constant.

fn plane_set<const D: usize>(
    source: &SetSource<D>,
    kinematics: Kinematics,
) -> Box<dyn ElementSet<D>> {
    match source.kind {
        ElementKind::Tri3 => set::<D, 3, 1>(source, kinematics),
        ElementKind::Quad4 => set::<D, 4, 4>(source, kinematics),
        kind => unreachable!("a {} in 2-D", kind.name()),
    }
}

fn solid_set<const D: usize>(
    source: &SetSource<D>,
    kinematics: Kinematics,
) -> Box<dyn ElementSet<D>> {
    match source.kind {
        ElementKind::Tet4 => set::<D, 4, 1>(source, kinematics),
        ElementKind::Wedge6 => set::<D, 6, 6>(source, kinematics),
        ElementKind::Hex8 => set::<D, 8, 8>(source, kinematics),
        kind => unreachable!("a {} in 3-D", kind.name()),
    }
}

fn set<const D: usize, const N: usize, const Q: usize>(
    source: &SetSource<D>,
    kinematics: Kinematics,
) -> Box<dyn ElementSet<D>> {
    match kinematics {
        Kinematics::Total => Box::new(FormulationSet::<D, N, Q, TotalLagrangian>::new(source)),
        Kinematics::Incremental => Box::new(FormulationSet::<D, N, Q, Hypoelastic>::new(source)),
    }
}
