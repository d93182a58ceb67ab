//! The base model, over which overlays are built.

use nalgebra::{DMatrix, DVector};

use crate::contact::surface::Surface;
use crate::element::mass::Masses;
use crate::element::material::Elastic;
use crate::element::{self, BlockProperties, ElementSet, stable_step};
use crate::math::adjacency::Adjacency;
use crate::math::vector::{add, scale, sub};
use crate::mesh::{Element, ElementKind, Mesh, volume};
use crate::model::block_properties;
use crate::model::load::thickness;
use crate::model::time_levels::level_of;
use crate::model::time_step::SAFETY_NEAR_LIMIT;
use crate::refinement::dimension::Space;
use crate::refinement::overlay::{Overlay, RefinementRequest};
use crate::refinement::prolongation::rotation;
use crate::refinement::refined_block::RefinedBlock;
use crate::refinement::zone::size;
use crate::refinement::{BaseMesh, composite_mesh};
use crate::scene::Scene;

/// The blocks before refinement.
pub(crate) struct BaseModel<const D: usize> {
    pub(crate) scene: Scene,
    pub(crate) mesh: Mesh<D>,
    pub(crate) masses: Masses,
    /// Level of each element by its own stable step.
    pub(crate) level: Vec<u8>,
    pub(crate) space: Space<D>,
    around: Adjacency,
    materials: Vec<Elastic>,
    properties: Vec<BlockProperties>,
    /// Coarse step, s, over the fraction of their stable step that new elements use.
    step: f64,
}

/// Levels of the base mesh.
pub(crate) struct BaseLevels {
    /// Level of each element by its own stable step.
    pub(crate) level: Vec<u8>,
    /// Coarse step, s.
    pub(crate) step: f64,
}

impl<const D: usize> BaseModel<D> {
    /// Builds the base model.
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh<D>,
        masses: Masses,
        levels: BaseLevels,
        space: Space<D>,
    ) -> Self {
        let elements = mesh.elements.iter().map(Element::nodes);
        let sources = mesh.blocks.iter().map(|block| block.source);
        Self {
            around: Adjacency::new(elements, mesh.nodes.len()),
            properties: sources
                .map(|source| block_properties(scene, source))
                .collect(),
            materials: scene.material.iter().map(Elastic::new).collect(),
            step: levels.step / scene.time.safety.min(SAFETY_NEAR_LIMIT),
            scene: scene.clone(),
            mesh: mesh.clone(),
            masses,
            level: levels.level,
            space,
        }
    }

    /// Returns the level of a new element of angular frequency `omega`, rad/s, in a block; `None`
    /// if it would need a finer level than there is.
    pub(super) fn level(&self, block: usize, omega: f64) -> Option<u8> {
        level_of(
            self.step,
            stable_step(omega, self.material(block).damping.stiffness),
        )
    }

    /// Builds the overlay of a block, if any element is `wanted` smaller.
    pub(super) fn overlay(&self, block: usize, wanted: RefinementRequest<D>) -> Option<Overlay<D>> {
        let base = BaseMesh::new(&self.mesh, &self.around);
        (self.space.overlay)(base, &self.mesh, block, wanted)
    }

    /// Returns the nodal masses of a block, refined or not, kg.
    pub(crate) fn nodal_masses<'a>(
        &'a self,
        block: usize,
        refined_block: Option<&'a RefinedBlock<D>>,
    ) -> &'a [f64] {
        let nodes = &self.mesh.blocks[block].nodes;
        match refined_block {
            Some(refined_block) => &refined_block.mass,
            None => &self.masses.nodal[nodes.start as usize..nodes.end as usize],
        }
    }

    /// Returns the size of the largest element of a block, m.
    pub(super) fn largest_size(&self, block: usize) -> f64 {
        let elements = self.mesh.blocks[block].elements.clone();
        elements
            .map(|element| self.size(element))
            .fold(0.0, f64::max)
    }

    /// Returns the size of an element, m.
    pub(super) fn size(&self, element: u32) -> f64 {
        size(&self.corners(element))
    }

    /// Returns the mass of the square or cubic cell that an element is a part of, kg. A node inside
    /// a block of such elements has this mass.
    pub(super) fn cell_mass(&self, block: usize, element: u32) -> f64 {
        let kind = self.mesh.elements[element as usize].kind;
        let parts = match kind {
            ElementKind::Quad4 | ElementKind::Hex8 => 1.0,
            ElementKind::Tri3 | ElementKind::Wedge6 => 2.0,
            ElementKind::Tet4 => 6.0,
        };
        parts * self.density(block) * volume(kind, &self.corners(element))
    }

    fn corners(&self, element: u32) -> Vec<[f64; D]> {
        let nodes = self.mesh.elements[element as usize].nodes().iter();
        nodes.map(|&node| self.mesh.nodes[node as usize]).collect()
    }

    /// Returns the mass of a block over its volume, kg/m^D.
    fn density(&self, block: usize) -> f64 {
        thickness::<D>(&self.scene) * self.material(block).density
    }

    /// Returns λ (in 2-D, that of plane stress or plane strain) and μ of a block, Pa.
    pub(crate) fn lame(&self, block: usize) -> [f64; 2] {
        let material = self.material(block);
        let lambda = if D == 2 {
            material.in_plane_lambda(self.scene.plane)
        } else {
            material.lame_lambda
        };
        [lambda, material.shear_modulus]
    }

    /// Returns the material of a block.
    pub(crate) fn material(&self, block: usize) -> &Elastic {
        &self.materials[self.properties[block].material]
    }

    /// Builds the boundary of a mesh of all blocks, with a contact `resolution`, m.
    pub(crate) fn surface(&self, mesh: &Mesh<D>, resolution: f64) -> Box<dyn Surface<D>> {
        (self.space.surface)(mesh, thickness::<D>(&self.scene), resolution)
    }

    /// Builds the elements of a mesh of one block.
    pub(super) fn sets(&self, block: usize, mesh: &Mesh<D>) -> Vec<Box<dyn ElementSet<D>>> {
        self.build(&self.properties[block..=block], mesh)
    }

    /// Builds the elements of a mesh of all blocks.
    pub(crate) fn all_sets(&self, mesh: &Mesh<D>) -> Vec<Box<dyn ElementSet<D>>> {
        self.build(&self.properties, mesh)
    }

    /// Returns the strain energy of a block, refined or not, J, after a deformation in one
    /// increment followed by a rotation.
    pub(crate) fn strain_energy(
        &self,
        block: usize,
        refined_block: Option<&RefinedBlock<D>>,
        displacement: &[[f64; D]],
    ) -> f64 {
        let overlay = refined_block.map(|refined_block| &refined_block.overlay);
        let mesh = composite_mesh::of_block(&self.mesh, block, overlay);
        let deformation = turned_back(&mesh.nodes, displacement);
        let sets = self.sets(block, &mesh);
        let all = sets
            .iter()
            .flat_map(|set| (0..set.len()).map(move |i| (set, i)));
        all.map(|(set, i)| set.strain_energy(i, &deformation)).sum()
    }

    fn build(&self, properties: &[BlockProperties], mesh: &Mesh<D>) -> Vec<Box<dyn ElementSet<D>>> {
        let thickness = thickness::<D>(&self.scene);
        element::build(
            mesh,
            properties,
            &self.materials,
            self.scene.plane,
            thickness,
        )
    }
}

/// Returns the displacements, m, without the rotation of the body. Incremental elements would take
/// it for a path of deformation.
fn turned_back<const D: usize>(points: &[[f64; D]], displacement: &[[f64; D]]) -> Vec<[f64; D]> {
    let count = points.len() as f64;
    let mean = |field: &[[f64; D]]| {
        let sum = field.iter().fold([0.0; D], |sum, x| add(&sum, x));
        scale(1.0 / count, &sum)
    };
    let (centre, shift) = (mean(points), mean(displacement));
    let arms = points.iter().map(|point| sub(point, &centre));
    let moved = arms.clone().zip(displacement);
    let moved = moved.map(|(arm, moved)| add(&arm, &sub(moved, &shift)));
    let mut products = DMatrix::zeros(D, D);
    for (arm, moved) in arms.clone().zip(moved.clone()) {
        products +=
            DVector::from_column_slice(&moved) * DVector::from_column_slice(&arm).transpose();
    }
    let turn = rotation(products);
    let back = |moved: &[f64; D]| -> [f64; D] {
        std::array::from_fn(|i| (0..D).map(|j| turn[(j, i)] * moved[j]).sum())
    };
    arms.zip(moved)
        .map(|(arm, moved)| sub(&back(&moved), &arm))
        .collect()
}
