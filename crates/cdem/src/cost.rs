//! What the forces of elements take: bytes and operations, to be held against what a machine does.

use crate::Simulation;
use crate::element::ElementSet;
use crate::mesh::Mesh;
use crate::simulation::each;

/// What an update of an element takes, the mean of all elements of a model; damping and contact are
/// left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpdateCost {
    /// Bytes that must come from memory and go there: the element at rest, numbers of its nodes,
    /// what it keeps from step to step, there and back; and, once a node and shared among its
    /// elements, displacement, and force there and back.
    pub bytes: f64,
    /// Additions, subtractions, multiplications and divisions.
    pub operations: f64,
}

impl Simulation {
    /// What an update of an element takes in the mesh of now; 0 without elements.
    #[must_use]
    pub fn update_cost(&self) -> UpdateCost {
        each!(self, driven => of_mesh(&driven.run.model.mesh, &driven.run.model.sets))
    }
}

fn of_mesh<const D: usize>(mesh: &Mesh<D>, sets: &[Box<dyn ElementSet<D>>]) -> UpdateCost {
    let (mut bytes, mut operations) = (mesh.nodes.len() * 3 * size_of::<[f64; D]>(), 0);
    for set in sets {
        let of_each = set.update_cost();
        bytes += set.len() * of_each[0];
        operations += set.len() * of_each[1];
    }
    let elements = mesh.elements.len().max(1) as f64;
    UpdateCost {
        bytes: bytes as f64 / elements,
        operations: operations as f64 / elements,
    }
}
