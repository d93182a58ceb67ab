//! Finite elements: internal forces, stress, masses and stable steps.
//!
//! Elements of one shape and one kinematic formulation form an
//! [`ElementSet`]; [`build`] sorts the elements of a mesh into such sets. The
//! step loop knows nothing but the trait.
//!
//! Deformation is measured from displacements, F = I + Σ (u_a − u_0) ⊗ ∇N_a,
//! and the force on an element's first node is minus the sum of the others.
//! So a far-off body loses no digits, and each element's impulses add up to
//! zero to round-off.

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

/// Most nodes of an element: a hexahedron's.
pub(crate) const MAX_NODES: usize = 8;

/// What the elements of a block are made of and how they deform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockProperties {
    /// Index of its material.
    pub material: usize,
    /// Kinematic formulation.
    pub kinematics: Kinematics,
}

/// Extremes of the deformation over an element's Gauss points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Deformation {
    /// Smallest det F; not positive: the element is inverted.
    pub min_jacobian: f64,
    /// Smallest principal stretch in the space of the mesh.
    pub min_stretch: f64,
    /// Largest principal stretch in the space of the mesh.
    pub max_stretch: f64,
}

/// What an element of incremental kinematics knows of its past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StressHistory<const D: usize> {
    /// Cauchy stress, the mean over its volume at rest, Pa.
    pub(crate) stress: [[f64; D]; D],
    /// Work done on it that the stress does not hold, J: the energy of what deviates from
    /// a mean goes with it.
    pub(crate) excess: f64,
    /// That volume, m³.
    pub(crate) volume: f64,
}

impl<const D: usize> StressHistory<D> {
    /// Of several elements together.
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

/// What is due in a kick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Due<'a> {
    /// The coarsest level that is due.
    pub(crate) coarsest: u8,
    /// Over which time.
    pub(crate) interval: Interval<'a>,
    /// Whether the elements' history goes on with it; a report leaves no trace there.
    pub(crate) is_kept: bool,
}

/// Interval of a kick, s.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Interval<'a> {
    /// One a level.
    OfLevel(&'a [f64]),
    /// One an element of the mesh.
    OfElement(&'a [f64]),
}

/// Elements of one shape and one kinematic formulation, as arrays.
///
/// `i` is a number within the set. Displacements and velocities are those of all nodes of
/// the mesh. Gauss points and weights are fixed at rest; 2-D volumes include the thickness.
/// Numbers out of range panic.
///
/// Those of one level near each other form a group: they are kicked together, and give each
/// of their nodes one share.
pub(crate) trait ElementSet<const D: usize>: Send + Sync {
    /// Formulation of the elements.
    fn kinematics(&self) -> Kinematics;

    /// Number of elements.
    fn len(&self) -> usize;

    /// Number in [`Mesh::elements`] of each element, ascending.
    fn mesh_elements(&self) -> &[u32];

    /// Nodes of element `i` of this mesh's.
    fn nodes<'a>(&self, mesh: &'a Mesh<D>, i: usize) -> &'a [u32] {
        mesh.elements[self.mesh_elements()[i] as usize].nodes()
    }

    /// Sorts the elements into groups by the level of each element of the mesh; those
    /// without one are never due. All are of level 0 at first.
    fn arrange(&mut self, level: &dyn Fn(u32) -> Option<u8>);

    /// Visits level and nodes of each group, in the order of [`GroupImpulses`].
    fn each_group(&self, visit: &mut dyn FnMut(Option<u8>, &[u32]));

    /// Writes the impulses of the groups that are due to their shares: the sums of
    /// interval·f over their elements, N·s, f being the internal nodal force (minus the
    /// energy gradient, N); and brings the elements' history up to the displacements
    /// (incremental kinematics: stress turned and updated, work added up).
    ///
    /// With stiffness-proportional damping β the impulse of the viscous stress
    /// β·C:(strain rate) goes to the second shares. `motion` is displacements, m, and
    /// velocities, m/s.
    fn kick(&mut self, due: &Due, motion: [&[[f64; D]]; 2], shares: GroupImpulses<D>);

    /// Brings the history of element `i` up to `displacement`.
    fn bring_up(&mut self, i: usize, displacement: &[[f64; D]]);

    /// Strain energy of element `i`, J. Incremental kinematics: the work done
    /// on it up to its last kick and from there straight to `displacement`.
    fn strain_energy(&self, i: usize, displacement: &[[f64; D]]) -> f64;

    /// Tells the strain energy of every element, by its number in the mesh, in no order.
    fn strain_energies(&self, displacement: &[[f64; D]], tell: &mut dyn FnMut(u32, f64));

    /// Tells the Cauchy stress of every element, by its number in the mesh, in no order: its
    /// average over the current volume, xx yy zz xy yz zx, Pa; zz of plane strain is there in
    /// 2-D too.
    fn stresses(&self, displacement: &[[f64; D]], tell: &mut dyn FnMut(u32, [f64; 6]));

    /// Nodal forces of element `i`, N, without a trace in the history: as many
    /// as it has nodes, to the head of `force`.
    fn force(&self, i: usize, displacement: &[[f64; D]], force: &mut [[f64; D]]);

    /// What strain rates change of them in a second, −K·v, N/s, for velocities v
    /// of its nodes.
    fn force_rate(
        &self,
        i: usize,
        displacement: &[[f64; D]],
        velocity: &[[f64; D]],
        rate: &mut [[f64; D]],
    );

    /// Tells of every element that is inside out or strained by more than `most`, a tenth at
    /// most, in the norm of Green's strain at all its Gauss points together: of the others no
    /// principal stretch is beyond √(1 ± 2 most). Elements are told by their numbers in the
    /// mesh, in no order.
    fn strained(&self, displacement: &[[f64; D]], most: f64, tell: &mut dyn FnMut(u32));

    /// Extremes of the deformation of element `i`.
    fn deformation(&self, i: usize, displacement: &[[f64; D]]) -> Deformation;

    /// Highest angular frequency of element `i` alone, rad/s: exact for its
    /// stiffness at rest and its own row-sum masses times `mass_factor` of
    /// the nodes (one for each node of the mesh). The highest of all elements
    /// bounds that of the assembled mesh (Irons 1970).
    fn frequency(&self, i: usize, mass_factor: &[f64]) -> f64;

    /// Highest angular frequency of element `i` alone with its consistent
    /// mass matrix, rad/s.
    fn consistent_frequency(&self, i: usize, mesh: &Mesh<D>) -> f64;

    /// Row sums of the mass matrix of element `i`, one for each of its N
    /// nodes, kg, into the first N entries of `out`.
    fn lumped_mass(&self, i: usize, out: &mut [f64]);

    /// Consistent mass matrix of element `i`, ∫ρ N_a N_b, kg: N×N, row by row,
    /// into the first N² entries of `out`.
    fn consistent_mass(&self, i: usize, mesh: &Mesh<D>, out: &mut [f64]);

    /// Stiffness of element `i` at rest, N/m: (N·D)×(N·D), row by row, the
    /// components of a node together, into the first (N·D)² entries of `out`.
    fn stiffness(&self, i: usize, out: &mut [f64]);

    /// How many numbers an element keeps from kick to kick.
    fn record_length(&self) -> usize;

    /// All that element `i` keeps from kick to kick; nothing where only the present counts.
    fn record(&self, i: usize) -> Vec<f64>;

    /// Gives element `i` what the same element of another set has kept.
    fn set_record(&mut self, i: usize, record: &[f64]);

    /// What element `i` knows of its past up to its last kick, if that matters.
    fn past(&self, i: usize) -> Option<StressHistory<D>>;

    /// Gives element `i` the past of one, or of a part of one, that is deformed as it is
    /// now: so much a volume.
    fn set_past(&mut self, i: usize, past: &StressHistory<D>, displacement: &[[f64; D]]);

    /// Bytes of all elements.
    fn memory(&self) -> usize;

    /// Of an element: bytes that its kick must read or write but for what is at nodes, and its
    /// operations. Damping is left out.
    fn update_cost(&self) -> [usize; 2];
}

/// Sorts the elements of `mesh` into sets: one for each shape and formulation
/// in use, shapes in the order of [`ElementKind`], `TotalLagrangian` first.
///
/// `properties` has one entry for each block of the mesh; `plane` and
/// `thickness` (m) matter in 2-D only.
///
/// # Panics
/// When an element does not have dimension `D`, or `properties` or
/// `materials` are too short: the caller checks its input.
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
            sets.push(match kind {
                ElementKind::Tri3 => set::<D, 3, 1>(&source, kinematics),
                ElementKind::Quad4 => set::<D, 4, 4>(&source, kinematics),
                ElementKind::Tet4 => set::<D, 4, 1>(&source, kinematics),
                ElementKind::Wedge6 => set::<D, 6, 6>(&source, kinematics),
                ElementKind::Hex8 => set::<D, 8, 8>(&source, kinematics),
            });
        }
    }
    sets
}

/// (element of the mesh, material) of a set to be.
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

fn set<const D: usize, const N: usize, const Q: usize>(
    source: &SetSource<D>,
    kinematics: Kinematics,
) -> Box<dyn ElementSet<D>> {
    match kinematics {
        Kinematics::Total => Box::new(FormulationSet::<D, N, Q, TotalLagrangian>::new(source)),
        Kinematics::Incremental => Box::new(FormulationSet::<D, N, Q, Hypoelastic>::new(source)),
    }
}
