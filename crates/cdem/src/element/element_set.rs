//! The one implementation of [`ElementSet`].

use std::marker::PhantomData;

use crate::element::batch::Batches;
use crate::element::chunk::{Chunk, ElementSlot, LevelGroup, Member, chunk_size};
use crate::element::geometry::{
    self, ElementGeometry, IntegrationPoints, Lame, Moduli, NodalValues, ReferenceElement,
};
use crate::element::internal_force::{GroupImpulses, InternalForceKick, each_chunk};
use crate::element::simd::Real;
use crate::element::tensor::{self, Tensor};
use crate::element::{
    Deformation, Due, ElementSet, GroupNodes, MAX_NODES, PaddedNodal, StressHistory, critical_step,
    evaluate, op_count,
};
use crate::math::vector::sub;
use crate::mesh::{ElementKind, ElementOrigins, Mesh};
use crate::scene::Kinematics;

/// Largest number of numbers in a record: that of a hexahedron with incremental kinematics.
pub(super) const MAX_RECORD: usize = 70;

/// The record of an element, stored from kick to kick: numbers by index, of one element or of
/// several in SIMD lanes.
pub(super) trait ElementRecord<T> {
    /// Returns the number at an index.
    fn get(&self, place: usize) -> T;
}

/// A record that can be updated.
pub(super) trait ElementRecordMut<T>: ElementRecord<T> {
    /// Replaces the number at an index. A formulation reads no number again after it has set it.
    fn set(&mut self, place: usize, number: T);
}

impl<T: Real> ElementRecord<T> for [T] {
    #[inline(always)]
    fn get(&self, place: usize) -> T {
        self[place]
    }
}

impl<T: Real> ElementRecordMut<T> for [T] {
    #[inline(always)]
    fn set(&mut self, place: usize, number: T) {
        self[place] = number;
    }
}

/// A formulation: the computation of forces from nodal displacements.
///
/// Nodal displacements and velocities are relative to the first node of the element.
pub(super) trait Formulation<const D: usize, const N: usize, const Q: usize>:
    Send + Sync
{
    /// Its name in scenes.
    const KINEMATICS: Kinematics;

    /// Number of numbers in the record of an element.
    const RECORD: usize;

    /// Returns the nodal forces, N, and updates the record to these displacements.
    fn respond<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        displacement: &NodalValues<D, N, T>,
        record: &mut (impl ElementRecordMut<T> + ?Sized),
    ) -> NodalValues<D, N, T>;

    /// Returns the rate of change of the first Piola–Kirchhoff stress by strain rates, Pa/s, for
    /// gradients of displacement and velocity.
    fn stress_rate<T: Real>(
        lame: &Lame<T>,
        displacement: &Tensor<D, T>,
        velocity: &Tensor<D, T>,
    ) -> Tensor<D, T>;

    /// Returns the rate of change of the nodal forces by strain rates, N/s. Times β it is the force
    /// of stiffness-proportional damping.
    #[inline(always)]
    fn force_rate<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        displacement: &NodalValues<D, N, T>,
        velocity: &NodalValues<D, N, T>,
    ) -> NodalValues<D, N, T> {
        let mut force = geometry::nothing(displacement);
        for q in 0..Q {
            let (gradients, volume) = element.point(q);
            let h = geometry::gradient(&gradients, displacement);
            let rate = geometry::gradient(&gradients, velocity);
            let first_piola = Self::stress_rate(&element.lame(), &h, &rate);
            geometry::subtract_divergence(&mut force, &first_piola, &gradients, volume);
        }
        geometry::balance(&mut force);
        force
    }

    /// Returns the strain energy, J.
    fn strain_energy<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        displacement: &NodalValues<D, N, T>,
        record: &(impl ElementRecord<T> + ?Sized),
    ) -> T;

    /// Returns the integral of the Cauchy stress.
    fn stress<T: Real>(
        element: &impl IntegrationPoints<D, N, Q, T>,
        moduli: &Moduli,
        displacement: &NodalValues<D, N, T>,
        record: &(impl ElementRecord<T> + ?Sized),
    ) -> StressIntegral<T>;

    /// Returns the stress history of an element, if the formulation has one.
    fn stress_history(
        _element: &ElementGeometry<D, N, Q>,
        _moduli: &Moduli,
        _record: &[f64],
    ) -> Option<StressHistory<D>> {
        None
    }

    /// Sets the stress history of an element that `displacement` deforms now.
    fn set_stress_history(
        _element: &ElementGeometry<D, N, Q>,
        _moduli: &Moduli,
        _past: &StressHistory<D>,
        _displacement: &NodalValues<D, N>,
        _record: &mut [f64],
    ) {
    }
}

/// ∫σ over the current volume, and that volume.
pub(super) struct StressIntegral<T> {
    stress: [T; 6],
    volume: T,
}

impl<T: Real> StressIntegral<T> {
    /// Creates an empty integral.
    #[inline(always)]
    pub(super) fn new(zero: T) -> Self {
        Self {
            stress: [zero; 6],
            volume: zero,
        }
    }

    /// Adds a Gauss point of `volume` at rest with det F, Kirchhoff stress τ = Jσ, and in 2-D τ_zz
    /// `across`.
    #[inline(always)]
    pub(super) fn add<const D: usize>(
        &mut self,
        volume: T,
        jacobian: T,
        kirchhoff: &Tensor<D, T>,
        across: T,
    ) {
        let (t, zero) = (kirchhoff, across.constant(0.0));
        let voigt = if D == 2 {
            [t[0][0], t[1][1], across, t[0][1], zero, zero]
        } else {
            [t[0][0], t[1][1], t[2][2], t[0][1], t[1][2], t[2][0]]
        };
        for i in 0..6 {
            self.stress[i] += volume * voigt[i];
        }
        self.volume += volume * jacobian;
    }

    /// Returns the mean: xx yy zz xy yz zx.
    #[inline(always)]
    pub(super) fn average(&self) -> [T; 6] {
        let mut average = self.stress;
        for i in 0..6 {
            average[i] = self.stress[i] / self.volume;
        }
        average
    }
}

/// Returns nodal vectors with zeros for the missing nodes.
fn padded<const D: usize, const N: usize>(vectors: &NodalValues<D, N>) -> PaddedNodal<D> {
    let mut padded = [[0.0; D]; MAX_NODES];
    padded[..N].copy_from_slice(vectors);
    padded
}

/// Elements of one shape in one formulation.
pub(super) struct FormulationSet<const D: usize, const N: usize, const Q: usize, F> {
    kind: ElementKind,
    /// Thickness, m; 1 in 3-D.
    thickness: f64,
    mesh_elements: Vec<u32>,
    slots: Vec<ElementSlot>,
    chunks: Vec<Chunk<D, N, Q>>,
    formulation: PhantomData<F>,
}

/// The data that a set is built from.
pub(super) struct SetSource<'a, const D: usize> {
    pub(super) kind: ElementKind,
    /// Elements of the mesh, ascending, and their materials.
    pub(super) members: &'a [(u32, u32)],
    pub(super) moduli: &'a [Moduli],
    pub(super) mesh: &'a Mesh<D>,
    /// Thickness, m; 1 in 3-D.
    pub(super) thickness: f64,
}

impl<const D: usize, const N: usize, const Q: usize, F> FormulationSet<D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    /// Creates undeformed, stress-free elements.
    pub(super) fn new(source: &SetSource<D>) -> Self {
        const { assert!(F::RECORD <= MAX_RECORD) };
        let mut set = Self {
            kind: source.kind,
            thickness: source.thickness,
            mesh_elements: source.members.iter().map(|member| member.0).collect(),
            slots: vec![ElementSlot::default(); source.members.len()],
            chunks: Vec::new(),
            formulation: PhantomData,
        };
        // Material, index in the set and index in the mesh.
        let members = source.members.iter().zip(0..);
        let mut members: Vec<(u32, u32, u32)> = members
            .map(|(&(element, material), number)| (material, number, element))
            .collect();
        members.sort_unstable();
        for alike in members.chunk_by(|one, other| one.0 == other.0) {
            let moduli = &source.moduli[alike[0].0 as usize];
            for chunk in alike.chunks(chunk_size(alike.len())) {
                let members = chunk.iter().map(|&(_, number, element)| {
                    let (nodes, element) = set.at_rest(source.mesh, element, moduli);
                    Member {
                        number,
                        nodes,
                        element,
                        record: vec![0.0; F::RECORD],
                    }
                });
                let members: Vec<_> = members.collect();
                set.chunks.push(Chunk::new(*moduli, &members));
            }
        }
        for chunk in 0..set.chunks.len() {
            set.store_slots(chunk);
        }
        set
    }

    /// Returns the nodes of an element of the mesh, and its geometry at rest.
    fn at_rest(
        &self,
        mesh: &Mesh<D>,
        element: u32,
        moduli: &Moduli,
    ) -> ([u32; N], ElementGeometry<D, N, Q>) {
        let weight = |parts: &ElementOrigins| parts.weight[element as usize];
        let weight = mesh.parts.as_ref().map_or(1.0, weight);
        let corners = self.corners(mesh, element);
        let nodes = mesh.elements[element as usize].nodes;
        let nodes = std::array::from_fn(|a| nodes[a]);
        (nodes, corners.element(weight, moduli.lame))
    }

    fn corners(&self, mesh: &Mesh<D>, element: u32) -> ReferenceElement<D, N> {
        let nodes = mesh.elements[element as usize].nodes();
        ReferenceElement {
            kind: self.kind,
            at: std::array::from_fn(|a| mesh.nodes[nodes[a] as usize]),
            thickness: self.thickness,
        }
    }

    /// Stores the slots of the elements of a chunk.
    fn store_slots(&mut self, chunk: usize) {
        let members = self.chunks[chunk].groups().iter();
        let members = members.flat_map(|group| &group.members);
        for (within, &number) in members.enumerate() {
            self.slots[number as usize] = ElementSlot::new(chunk, within);
        }
    }

    fn chunk(&self, i: usize) -> &Chunk<D, N, Q> {
        &self.chunks[self.slots[i].chunk()]
    }

    fn moduli(&self, i: usize) -> &Moduli {
        &self.chunk(i).moduli
    }

    fn group(&self, i: usize) -> (&LevelGroup<D, N, Q>, usize) {
        let chunk = self.chunk(i);
        let (group, index) = chunk.group_of(self.slots[i].within());
        (&chunk.groups()[group], index)
    }

    fn element(&self, i: usize) -> ElementGeometry<D, N, Q> {
        let (group, index) = self.group(i);
        group.element(index, self.moduli(i))
    }

    /// Returns `field` at the nodes of element `i` minus its value at the first node.
    #[inline]
    fn relative(&self, i: usize, field: &[[f64; D]]) -> NodalValues<D, N> {
        let (group, index) = self.group(i);
        let nodes = group.nodes_of(index);
        let first = field[nodes[0] as usize];
        nodes.map(|node| sub(&field[node as usize], &first))
    }

    /// Reads the record of element `i` into the head of `numbers` and returns it.
    fn read_record<'a>(&self, i: usize, numbers: &'a mut [f64; MAX_RECORD]) -> &'a mut [f64] {
        let (group, index) = self.group(i);
        let record = &mut numbers[..F::RECORD];
        group.record(index, record);
        record
    }
}

impl<const D: usize, const N: usize, const Q: usize, F> ElementSet<D> for FormulationSet<D, N, Q, F>
where
    F: Formulation<D, N, Q>,
{
    fn kinematics(&self) -> Kinematics {
        F::KINEMATICS
    }

    fn len(&self) -> usize {
        self.mesh_elements.len()
    }

    fn mesh_elements(&self) -> &[u32] {
        &self.mesh_elements
    }

    fn arrange(&mut self, levels: &[Option<u8>]) {
        for chunk in 0..self.chunks.len() {
            let of = |number: u32| levels[self.mesh_elements[number as usize] as usize];
            if self.chunks[chunk].arrange(F::RECORD, of) {
                self.store_slots(chunk);
            }
        }
    }

    fn groups(&self) -> Vec<GroupNodes<'_>> {
        let groups = self.chunks.iter().flat_map(|chunk| chunk.groups());
        let nodes = groups.map(|group| GroupNodes {
            level: group.level,
            nodes: &group.nodes,
        });
        nodes.collect()
    }

    fn kick(&mut self, due: &Due, motion: [&[[f64; D]]; 2], group_impulses: GroupImpulses<D>) {
        let kick = InternalForceKick::<D, F>::new(due, motion, &self.mesh_elements);
        each_chunk(
            &mut self.chunks,
            group_impulses,
            due.coarsest,
            &|chunk, group_impulses| {
                kick.chunk(chunk, group_impulses);
            },
        );
    }

    fn update_record(&mut self, i: usize, displacement: &[[f64; D]]) {
        let mut numbers = [0.0; MAX_RECORD];
        let record = self.read_record(i, &mut numbers);
        F::respond(&self.element(i), &self.relative(i, displacement), record);
        self.set_record(i, record);
    }

    fn strain_energy(&self, i: usize, displacement: &[[f64; D]]) -> f64 {
        let mut numbers = [0.0; MAX_RECORD];
        let record = self.read_record(i, &mut numbers);
        F::strain_energy(&self.element(i), &self.relative(i, displacement), record)
    }

    fn add_strain_energies(&self, displacement: &[[f64; D]], is_counted: &[bool], sum: &mut f64) {
        evaluate::evaluate_all::<evaluate::StrainEnergy<F>, D, N, Q, 1>(
            &self.chunks,
            displacement,
            |_| true,
            |member, [energy]| {
                if is_counted[self.mesh_elements[member as usize] as usize] {
                    *sum += energy;
                }
            },
        );
    }

    fn stresses(&self, displacement: &[[f64; D]], stresses: &mut [[f64; 6]]) {
        evaluate::evaluate_all::<evaluate::CauchyStress<F>, D, N, Q, 6>(
            &self.chunks,
            displacement,
            |_| true,
            |member, stress| stresses[self.mesh_elements[member as usize] as usize] = stress,
        );
    }

    fn strained(&self, displacement: &[[f64; D]], most: f64) -> Vec<u32> {
        let mut strained = Vec::new();
        // Within such strains det F is near 1 or near −1. Near −1, `changes` is at least 4.
        let is_within = |&[strains, changes]: &[f64; 2]| strains <= most * most && changes < 1.0;
        evaluate::evaluate_all::<evaluate::Distortion, D, N, Q, 2>(
            &self.chunks,
            displacement,
            |value| !is_within(value),
            |member, _| strained.push(self.mesh_elements[member as usize]),
        );
        strained
    }

    fn force(&self, i: usize, displacement: &[[f64; D]]) -> PaddedNodal<D> {
        let mut numbers = [0.0; MAX_RECORD];
        let record = self.read_record(i, &mut numbers);
        let found = F::respond(&self.element(i), &self.relative(i, displacement), record);
        padded(&found)
    }

    fn force_rate(
        &self,
        i: usize,
        displacement: &[[f64; D]],
        velocity: &PaddedNodal<D>,
    ) -> PaddedNodal<D> {
        let u = self.relative(i, displacement);
        let velocity = std::array::from_fn(|a| sub(&velocity[a], &velocity[0]));
        padded(&F::force_rate(&self.element(i), &u, &velocity))
    }

    fn deformation(&self, i: usize, displacement: &[[f64; D]]) -> Deformation {
        let u = self.relative(i, displacement);
        let mut extremes = Deformation {
            min_jacobian: f64::INFINITY,
            min_stretch: f64::INFINITY,
            max_stretch: 0.0,
        };
        for gradients in &self.element(i).gradients {
            let f = tensor::with_unit(&geometry::gradient(gradients, &u));
            let right_cauchy = tensor::transposed_product(&f, &f);
            let (low, high) = tensor::extreme_principal_values(&right_cauchy);
            extremes.min_jacobian = extremes.min_jacobian.min(tensor::determinant(&f));
            extremes.min_stretch = extremes.min_stretch.min(low.max(0.0).sqrt());
            extremes.max_stretch = extremes.max_stretch.max(high.sqrt());
        }
        extremes
    }

    fn frequency(&self, i: usize, mass_factor: &[f64]) -> f64 {
        let (group, index) = self.group(i);
        let element = self.element(i);
        let mut mass = element.lumped_mass(self.kind, self.moduli(i).density);
        for (mass, node) in mass.iter_mut().zip(group.nodes_of(index)) {
            *mass *= mass_factor[node as usize];
        }
        critical_step::lumped(&element, &mass)
    }

    fn consistent_frequency(&self, i: usize, mesh: &Mesh<D>) -> f64 {
        let corners = self.corners(mesh, self.mesh_elements[i]);
        let mass = corners.consistent_mass(self.moduli(i).density);
        critical_step::consistent(&self.element(i), &mass)
    }

    fn lumped_mass(&self, i: usize, out: &mut [f64]) {
        let density = self.moduli(i).density;
        out[..N].copy_from_slice(&self.element(i).lumped_mass(self.kind, density));
    }

    fn consistent_mass(&self, i: usize, mesh: &Mesh<D>, out: &mut [f64]) {
        let corners = self.corners(mesh, self.mesh_elements[i]);
        let mass = corners.consistent_mass(self.moduli(i).density);
        out[..N * N].copy_from_slice(mass.as_flattened());
    }

    fn stiffness(&self, i: usize, out: &mut [f64]) {
        let element = self.element(i);
        for row in 0..N * D {
            for column in 0..N * D {
                out[row * N * D + column] = element.stiffness(row, column);
            }
        }
    }

    fn record_length(&self) -> usize {
        F::RECORD
    }

    fn record(&self, i: usize) -> Vec<f64> {
        self.read_record(i, &mut [0.0; MAX_RECORD]).to_vec()
    }

    fn set_record(&mut self, i: usize, record: &[f64]) {
        let place = self.slots[i];
        let chunk = &mut self.chunks[place.chunk()];
        let (group, index) = chunk.group_of(place.within());
        chunk.groups_mut()[group].set_record(index, record);
    }

    fn stress_history(&self, i: usize) -> Option<StressHistory<D>> {
        let mut numbers = [0.0; MAX_RECORD];
        let record = self.read_record(i, &mut numbers);
        F::stress_history(&self.element(i), self.moduli(i), record)
    }

    fn set_stress_history(&mut self, i: usize, past: &StressHistory<D>, displacement: &[[f64; D]]) {
        let mut numbers = [0.0; MAX_RECORD];
        let record = self.read_record(i, &mut numbers);
        let u = self.relative(i, displacement);
        F::set_stress_history(&self.element(i), self.moduli(i), past, &u, record);
        self.set_record(i, record);
    }

    fn memory(&self) -> usize {
        let chunks = self.chunks.iter().map(Chunk::memory).sum::<usize>();
        chunks + self.len() * (size_of::<ElementSlot>() + size_of::<u32>())
    }

    fn update_cost(&self) -> [usize; 2] {
        let moved = Batches::<D, N, Q>::moved(F::RECORD);
        // Displacements minus those of the first node, and the sums of forces times interval.
        let at_nodes = (N - 1) * D + 2 * N * D;
        [moved, op_count::operations::<F, D, N, Q>() + at_nodes]
    }
}
