//! The model of a refined mesh.

use crate::element::{ElementNumbering, ElementSet};
use crate::mesh::Mesh;
use crate::model::inverse_mass::InverseMass;
use crate::model::{Model, block_of};
use crate::refinement::{Adaptivity, BaseModel, RefinedBlock};

/// The elements of a mesh: sets, and the numbering of elements in them.
pub(crate) struct MeshElements<const D: usize> {
    pub(super) mesh: Mesh<D>,
    pub(super) sets: Vec<Box<dyn ElementSet<D>>>,
    pub(super) numbering: ElementNumbering,
}

impl<const D: usize> Model<D> {
    /// Rebuilds the model for a refined mesh of the same blocks, at `time`. Returns the old mesh
    /// and its elements.
    pub(crate) fn remesh(&mut self, adaptivity: &Adaptivity<D>, time: f64) -> MeshElements<D> {
        let (base_model, refined_blocks) = (&adaptivity.base_model, adaptivity.refined_blocks());
        let mesh = adaptivity.mesh();
        let sets = base_model.all_sets(&mesh);
        let numbering = ElementNumbering::new(&sets, mesh.elements.len());
        let old = MeshElements {
            mesh: std::mem::replace(&mut self.mesh, mesh),
            sets: std::mem::replace(&mut self.sets, sets),
            numbering: std::mem::replace(&mut self.numbering, numbering),
        };
        self.block_of = block_of(&self.mesh);
        let meshes = [&old.mesh, &self.mesh];
        remesh_inertia(&mut self.inertia, base_model, refined_blocks, meshes);
        self.base_level = refined_levels(base_model, refined_blocks, &self.mesh);
        let had = "the mesh before refinement had these groups";
        self.loads = self.surface_loads(&base_model.scene).expect(had);
        self.boundaries = self.prescribed_motions(&base_model.scene).expect(had);
        self.set_prescribed_nodes(time);
        old
    }
}

/// Sets the nodal masses of a mesh with refined blocks, from those of another such mesh.
fn remesh_inertia<const D: usize>(
    inertia: &mut InverseMass<D>,
    base_model: &BaseModel<D>,
    refined_blocks: &[Option<RefinedBlock<D>>],
    meshes: [&Mesh<D>; 2],
) {
    let mut nodal = Vec::with_capacity(meshes[1].nodes.len());
    for (block, refined_block) in base_model.mesh.blocks.iter().zip(refined_blocks) {
        let nodes = block.nodes.start as usize..block.nodes.end as usize;
        match refined_block {
            Some(refined_block) => nodal.extend(&refined_block.mass),
            None => nodal.extend(&base_model.masses.nodal[nodes]),
        }
    }
    let dense = base_model.masses.consistent.iter();
    let dense = dense.filter(|dense| refined_blocks[dense.block as usize].is_none());
    let dense = dense.map(|dense| {
        let first = meshes.map(|mesh| mesh.blocks[dense.block as usize].nodes.start as usize);
        (first, dense.matrix.as_slice())
    });
    inertia.remesh(nodal, dense);
}

/// Returns the levels of the elements of a refined mesh by their own stable steps.
fn refined_levels<const D: usize>(
    base_model: &BaseModel<D>,
    refined_blocks: &[Option<RefinedBlock<D>>],
    mesh: &Mesh<D>,
) -> Vec<u8> {
    let roots = mesh.parts.iter().flat_map(|parts| &parts.root);
    let mut levels: Vec<u8> = if mesh.parts.is_some() {
        roots.map(|&root| base_model.level[root as usize]).collect()
    } else {
        base_model.level.clone()
    };
    for (block, refined_block) in mesh.blocks.iter().zip(refined_blocks) {
        let own = block.elements.start as usize..block.elements.end as usize;
        let changed = refined_block
            .iter()
            .flat_map(|refined_block| &refined_block.level);
        for (level, changed) in levels[own].iter_mut().zip(changed) {
            *level = changed.unwrap_or(*level);
        }
    }
    levels
}
