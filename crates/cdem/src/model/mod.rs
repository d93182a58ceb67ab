//! The model and the state: the arrays that a step reads and changes.

pub(crate) mod block_max;
pub(crate) mod block_names;
pub(crate) mod boundary;
pub(crate) mod error;
pub(crate) mod inverse_mass;
pub(crate) mod kinematics;
pub(crate) mod ledger;
pub(crate) mod load;
pub(crate) mod positions;
pub(crate) mod state;
pub(crate) mod steady_force;
pub(crate) mod time_levels;
pub(crate) mod time_step;

pub use crate::model::error::ModelError;

use crate::element::mass::MassKind;
use crate::element::{BlockProperties, ElementNumbering, ElementSet};
use crate::math::vector::add_scaled;
use crate::mesh::Mesh;
use crate::model::boundary::PrescribedMotion;
use crate::model::inverse_mass::InverseMass;
use crate::model::kinematics::NodalMotion;
use crate::model::load::SurfaceLoad;
use crate::model::positions::Positions;
pub(crate) use crate::model::state::State;
use crate::scene::{Damping, Problem, Scene, Schedule};

/// Mesh, elements, masses and loads. A step changes only the records of the elements and the
/// prescribed components in them; a change of mesh changes all. [`State`] stores the arrays that a
/// step changes.
pub(crate) struct Model<const D: usize> {
    pub(crate) mesh: Mesh<D>,
    /// Elements by shape and kinematics. Each set stores the stress history of its elements.
    pub(crate) sets: Vec<Box<dyn ElementSet<D>>>,
    /// Set of each element of the mesh, and its index in that set.
    pub(crate) numbering: ElementNumbering,
    pub(crate) inertia: InverseMass<D>,
    pub(crate) blocks: Vec<BlockData>,
    /// Index of the block of each node.
    pub(crate) block_of: Vec<u32>,
    pub(crate) gravity: Schedule<Vec<f64>>,
    pub(crate) loads: Vec<SurfaceLoad<D>>,
    pub(crate) boundaries: Vec<PrescribedMotion>,
    /// The coarse step, s, and the number of coarse steps of the run.
    pub(crate) step: f64,
    pub(crate) step_count: u64,
    /// End of the run, s.
    pub(crate) end: f64,
    /// Time level of each element by its own stable step.
    pub(crate) base_level: Vec<u8>,
    /// Largest and smallest stable step of an element, s.
    pub(crate) limits: [f64; 2],
    /// Warnings that the user should read before a run.
    pub(crate) warnings: Vec<Problem>,
}

/// Properties of a block that its mesh does not hold.
#[derive(Clone, Debug)]
pub(crate) struct BlockData {
    pub(crate) material: usize,
    pub(crate) fixed: bool,
    pub(crate) damping: Damping,
    pub(crate) mass_kind: MassKind,
    pub(crate) inertia_error: f64,
}

impl<const D: usize> Model<D> {
    /// Borrows the nodes and the state as one [`NodalMotion`].
    pub(crate) fn motion<'a>(&'a self, state: &'a mut State<D>) -> NodalMotion<'a, D> {
        NodalMotion {
            rest: &self.mesh.nodes,
            displacement: &mut state.displacement,
            compensation: &mut state.compensation,
            velocity: &mut state.velocity,
        }
    }

    /// Returns the centre of mass of a block, m. `at` gives the positions of the nodes.
    pub(crate) fn centre(&self, block: usize, at: impl Fn(usize) -> [f64; D]) -> [f64; D] {
        let mut sum = [0.0; D];
        let mut mass = 0.0;
        for node in self.nodes(block) {
            let m = self.inertia.mass()[node];
            mass += m;
            add_scaled(&mut sum, m, &at(node));
        }
        sum.map(|x| x / mass)
    }

    /// For each boundary condition: true if it acts at a time, s.
    pub(crate) fn active_boundaries(&self, time: f64) -> impl Iterator<Item = bool> + '_ {
        self.boundaries.iter().map(move |motion| motion.acts(time))
    }

    /// Returns the current positions.
    pub(crate) fn positions<'a>(&'a self, state: &'a State<D>) -> Positions<'a, D> {
        Positions::new(&self.mesh.nodes, &state.displacement)
    }

    /// True if the block of a node is fixed.
    pub(crate) fn is_fixed(&self, node: u32) -> bool {
        self.blocks[self.block_of[node as usize] as usize].fixed
    }

    /// Returns the damping of the block of a node.
    pub(crate) fn damping_of(&self, node: usize) -> &Damping {
        &self.blocks[self.block_of[node] as usize].damping
    }

    /// Returns the nodes of a block.
    pub(crate) fn nodes(&self, block: usize) -> std::ops::Range<usize> {
        let range = &self.mesh.blocks[block].nodes;
        range.start as usize..range.end as usize
    }

    /// Returns the elements of a block.
    pub(crate) fn elements(&self, block: usize) -> std::ops::Range<usize> {
        let range = &self.mesh.blocks[block].elements;
        range.start as usize..range.end as usize
    }

    /// Returns the strain energy of the elements of all blocks that are not fixed, J.
    pub(crate) fn strain_energy(&self, displacement: &[[f64; D]]) -> f64 {
        let mut moves = vec![true; self.mesh.elements.len()];
        for (number, block) in self.blocks.iter().enumerate() {
            if block.fixed {
                moves[self.elements(number)].fill(false);
            }
        }
        let mut sum = 0.0;
        for set in &self.sets {
            set.add_strain_energies(displacement, &moves, &mut sum);
        }
        sum
    }

    /// Returns the Cauchy stress of each element of the mesh, averaged over its current volume: xx
    /// yy zz xy yz zx, Pa.
    pub(crate) fn stresses(&self, displacement: &[[f64; D]]) -> Vec<[f64; 6]> {
        let mut stresses = vec![[0.0; 6]; self.mesh.elements.len()];
        for set in &self.sets {
            set.stresses(displacement, &mut stresses);
        }
        stresses
    }

    /// Returns the strain energy of the elements of a block, J.
    pub(crate) fn strain_energy_of(&self, block: usize, displacement: &[[f64; D]]) -> f64 {
        let elements = self.elements(block).map(|e| self.numbering.of(e));
        elements
            .map(|(set, i)| self.sets[set].strain_energy(i, displacement))
            .sum()
    }
}

/// Returns the block of each node.
pub(crate) fn block_of<const D: usize>(mesh: &Mesh<D>) -> Vec<u32> {
    let mut block_of = vec![0; mesh.nodes.len()];
    for (number, block) in mesh.blocks.iter().enumerate() {
        block_of[block.nodes.start as usize..block.nodes.end as usize].fill(number as u32);
    }
    block_of
}

/// Returns the material and the kinematics of the elements of a block of the scene.
pub(crate) fn block_properties(scene: &Scene, source: usize) -> BlockProperties {
    let block = &scene.block[source];
    let material = scene
        .material
        .iter()
        .position(|material| material.name == block.material);
    BlockProperties {
        material: material.expect("the scene check has found every material"),
        kinematics: block.kinematics,
    }
}
