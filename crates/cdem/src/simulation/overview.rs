//! Figures of a model, for `check` and the closing summary.

use crate::element::mass::MassKind;
use crate::refinement::ASSUMED_SPEED;
use crate::scene::{Problem, Scene};
use crate::simulation::typed_simulation::TypedSimulation;

/// Memory of mesh, levels and schedules for each element, bytes.
const BYTES_PER_ELEMENT: usize = 64;

/// Memory of the arrays for each node and dimension, bytes: positions, motion, impulses.
const BYTES_PER_NODE: usize = 120;

/// Figures of a model, for `check` and for the closing summary.
#[derive(Clone, Debug, Default)]
pub struct Overview {
    /// The blocks, in the order of the mesh.
    pub blocks: Vec<BlockOverview>,
    /// Number of nodes of all blocks.
    pub nodes: usize,
    /// Number of elements of all blocks.
    pub elements: usize,
    /// Smallest and largest stable step of an element, s.
    pub stable_step: [f64; 2],
    /// The coarse step, s.
    pub step: f64,
    /// Number of coarse steps of the run.
    pub step_count: u64,
    /// Number of elements of each time level, coarsest first, without fixed blocks.
    pub levels: Vec<u64>,
    /// Number of element updates in a coarse step.
    pub updates_per_step: u64,
    /// Approximate memory of model and state, bytes.
    pub memory_bytes: u64,
    /// Number of contact points that are closed now.
    pub contacts: usize,
    /// Warnings that a user should read before a run, each with its place in the scene.
    pub warnings: Vec<Problem>,
}

/// A block in an [`Overview`].
#[derive(Clone, Debug)]
pub struct BlockOverview {
    /// Name.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Number of elements.
    pub elements: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Mass, kg.
    pub mass: f64,
    /// Mass matrix in use.
    pub mass_kind: MassKind,
    /// Largest relative error of its moments of inertia.
    pub inertia_error: f64,
    /// True if the block cannot move.
    pub fixed: bool,
}

/// Predicted cost of a collision with adaptivity: the heaviest block that moves hits a block like
/// itself with a corner.
#[derive(Clone, Debug)]
pub struct CollisionOverview {
    /// Name of the block.
    pub block: String,
    /// Impact speed, m/s.
    pub speed: f64,
    /// Number of elements of the refined block; `None` if the block cannot be refined.
    pub elements: Option<usize>,
    /// Element updates of the block in a coarse step: refined, and now.
    pub updates_per_step: [u64; 2],
}

impl<const D: usize> TypedSimulation<D> {
    pub(crate) fn foresee_collision(&self) -> Option<CollisionOverview> {
        let estimate = self.run.adaptivity.as_ref()?.estimate_cost()?;
        Some(CollisionOverview {
            block: self.run.model.mesh.blocks[estimate.block].name.clone(),
            speed: ASSUMED_SPEED,
            elements: estimate.elements,
            updates_per_step: estimate.updates,
        })
    }

    pub(crate) fn overview(&self, scene: &Scene) -> Overview {
        let model = &self.run.model;
        let levels = self.run.workspace.schedule.histogram();
        let updates = levels
            .iter()
            .enumerate()
            .map(|(level, count)| count << level)
            .sum();
        let block = |(number, block): (usize, &crate::mesh::MeshBlock)| BlockOverview {
            name: block.name.clone(),
            material: scene.block[block.source].material.clone(),
            elements: model.elements(number).len(),
            nodes: model.nodes(number).len(),
            mass: model
                .nodes(number)
                .map(|node| model.inertia.mass()[node])
                .sum(),
            mass_kind: model.blocks[number].mass_kind,
            inertia_error: model.blocks[number].inertia_error,
            fixed: model.blocks[number].fixed,
        };
        let in_sets: usize = model.sets.iter().map(|set| set.memory()).sum();
        Overview {
            blocks: model.mesh.blocks.iter().enumerate().map(block).collect(),
            nodes: model.mesh.nodes.len(),
            elements: model.mesh.elements.len(),
            stable_step: [model.limits[1], model.limits[0]],
            step: model.step,
            step_count: model.step_count,
            levels,
            updates_per_step: updates,
            memory_bytes: (in_sets
                + model.inertia.dense_memory()
                + model.mesh.elements.len() * BYTES_PER_ELEMENT
                + model.mesh.nodes.len() * BYTES_PER_NODE * D) as u64,
            contacts: self
                .run
                .contacts
                .iter()
                .flat_map(|contacts| contacts.contact_points())
                .count(),
            warnings: model.warnings.clone(),
        }
    }
}
