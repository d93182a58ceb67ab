//! Dense mass matrices of blocks.

use nalgebra::DMatrix;

use crate::element::mass::{MAX_CONSISTENT_NODES, MassFault, in_block};
use crate::element::{self, ElementSet};
use crate::mesh::Mesh;

/// Largest number of nodes for which the frequency of the block is computed; above it is bounded.
const EXACT_FREQUENCY_NODES: usize = 64;

/// Consistent mass matrix of a block, the same for each component.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ConsistentMass {
    /// Index of its block.
    pub block: u32,
    /// First node of the block; the others follow.
    pub first_node: u32,
    /// Number of nodes n.
    pub size: usize,
    /// n×n, row by row, kg.
    pub matrix: Vec<f64>,
}

impl ConsistentMass {
    pub(super) fn new<const D: usize>(
        mesh: &Mesh<D>,
        sets: &[Box<dyn ElementSet<D>>],
        block: usize,
    ) -> Result<Self, MassFault> {
        let nodes = &mesh.blocks[block].nodes;
        let size = nodes.len();
        if size > MAX_CONSISTENT_NODES {
            return Err(MassFault::TooManyNodes { nodes: size });
        }
        let mut matrix = DMatrix::zeros(size, size);
        let mut local = [0.0; 64];
        for set in sets {
            for i in in_block(mesh, set.as_ref(), block) {
                set.consistent_mass(i, mesh, &mut local);
                scatter(set.nodes(mesh, i), nodes.start, 1, &local, &mut matrix);
            }
        }
        if matrix.clone().cholesky().is_none() {
            return Err(MassFault::NotPositive);
        }
        Ok(Self {
            block: block as u32,
            first_node: nodes.start,
            size,
            // Symmetric: columns are rows.
            matrix: matrix.as_slice().to_vec(),
        })
    }

    /// Returns the highest angular frequency of the block, rad/s: exact for up to 64 nodes. Above,
    /// it is the highest of its elements with their own consistent matrices, which is an upper
    /// bound.
    #[must_use]
    pub(crate) fn frequency<const D: usize>(
        &self,
        mesh: &Mesh<D>,
        sets: &[Box<dyn ElementSet<D>>],
    ) -> f64 {
        let exact = self.size <= EXACT_FREQUENCY_NODES;
        let order = if exact { self.size * D } else { 0 };
        let mut stiffness = DMatrix::zeros(order, order);
        let mut local = [0.0; 24 * 24];
        let mut bound: f64 = 0.0;
        for set in sets {
            for i in in_block(mesh, set.as_ref(), self.block as usize) {
                if exact {
                    set.stiffness(i, &mut local);
                    scatter(
                        set.nodes(mesh, i),
                        self.first_node,
                        D,
                        &local,
                        &mut stiffness,
                    );
                } else {
                    bound = bound.max(set.consistent_frequency(i, mesh));
                }
            }
        }
        if exact {
            element::highest_frequency(stiffness.as_slice(), &self.matrix, self.size)
        } else {
            bound
        }
    }
}

/// Adds the square matrix of an element, row by row with `components` per node, to that of the
/// block whose nodes begin at `first`.
fn scatter(nodes: &[u32], first: u32, components: usize, local: &[f64], matrix: &mut DMatrix<f64>) {
    let order = nodes.len() * components;
    let place = |at: usize| {
        let node = (nodes[at / components] - first) as usize;
        node * components + at % components
    };
    for row in 0..order {
        for column in 0..order {
            matrix[(place(row), place(column))] += local[row * order + column];
        }
    }
}
