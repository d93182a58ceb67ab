//! Solver of an island. The type of its SIMD blocks depends on how mass matrices couple nodes.

pub(crate) mod active_set_cg;
pub(crate) mod coloured_pass;
pub(crate) mod colouring;
pub(crate) mod contact_rows;
pub(crate) mod dof_map;
pub(crate) mod gauss_seidel;
pub(crate) mod inverse_mass_columns;
pub(crate) mod nonlinear_cg;
pub(crate) mod row_assembly;
pub(crate) mod simd_block;
pub(crate) mod system;
pub(crate) mod system_visits;
#[cfg(test)]
mod tests;

use crate::contact::constraint::contact_constraint::Constraint;
use crate::contact::solver::simd_block::{CoupledBlock, NodeBlock};
use crate::contact::solver::system::ContactSystem;
use crate::contact::tolerances::SMALL_BLOCK_NODES;
use crate::model::inverse_mass::{InverseMass, KickMobility};

/// Contacts that share nodes, solved together.
#[derive(Clone, Debug)]
pub(crate) enum Solver<const D: usize> {
    /// No mass matrix couples nodes that contacts move.
    Nodes(ContactSystem<D, NodeBlock>),
    /// Mass matrices couple at most [`SMALL_BLOCK_NODES`] nodes.
    Blocks(ContactSystem<D, CoupledBlock<false>>),
    /// A mass matrix couples more than [`SMALL_BLOCK_NODES`] nodes.
    LargeBlocks(ContactSystem<D, CoupledBlock<true>>),
}

/// Changes of relative velocities at which a solve ends.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Precision {
    /// Residual that is sufficient after [`EXACT_SWEEPS`](crate::contact::tolerances::EXACT_SWEEPS).
    pub(crate) residual: f64,
    /// Change of a relative velocity that counts as none, m/s.
    pub(crate) velocity: f64,
}

/// Evaluates an expression for the system of a solver, for each type of SIMD block.
macro_rules! with {
    ($solver:expr, $system:ident => $work:expr) => {
        match $solver {
            Solver::Nodes($system) => $work,
            Solver::Blocks($system) => $work,
            Solver::LargeBlocks($system) => $work,
        }
    };
}

impl<const D: usize> Default for Solver<D> {
    fn default() -> Self {
        Self::Nodes(ContactSystem::default())
    }
}

impl<const D: usize> Solver<D> {
    /// Takes the Jacobians of the constraints.
    pub(crate) fn load(&mut self, constraints: &[Constraint<D>], mobility: KickMobility<D>) {
        let coupled = Self::most_coupled(constraints, mobility.inertia);
        let fits = match self {
            Self::Nodes(_) => coupled == 1,
            Self::Blocks(_) => (2..=SMALL_BLOCK_NODES).contains(&coupled),
            Self::LargeBlocks(_) => coupled > SMALL_BLOCK_NODES,
        };
        if !fits {
            *self = match coupled {
                1 => Self::Nodes(ContactSystem::default()),
                2..=SMALL_BLOCK_NODES => Self::Blocks(ContactSystem::default()),
                _ => Self::LargeBlocks(ContactSystem::default()),
            };
        }
        with!(self, system => system.load(constraints, mobility));
    }

    /// Returns the largest number of nodes that a mass matrix couples to a node that contacts
    /// move. Stops as soon as a larger number would not change the type of the system.
    fn most_coupled(constraints: &[Constraint<D>], inertia: &InverseMass<D>) -> usize {
        let enough = if inertia.most_coupled() > SMALL_BLOCK_NODES {
            SMALL_BLOCK_NODES + 1
        } else {
            2
        };
        let mut most = 1;
        for &node in constraints.iter().flat_map(|c| c.jacobian.nodes()) {
            if most >= enough {
                break;
            }
            if !inertia.is_prescribed(node as usize) {
                most = most.max(inertia.coupled(node as usize).len());
            }
        }
        most
    }

    /// Finds the impulses of the loaded constraints and adds them to the velocities, m/s; see
    /// [`ContactSystem::solve`]. Returns the residual.
    pub(crate) fn solve(
        &mut self,
        constraints: &mut [Constraint<D>],
        velocity: &mut [[f64; D]],
        precision: Precision,
    ) -> f64 {
        with!(self, system => system.solve(constraints, velocity, precision))
    }

    /// Solves for nodes at rest. Returns the nodes that move and their velocities, m/s.
    pub(crate) fn solve_from_rest(
        &mut self,
        constraints: &[Constraint<D>],
        precision: Precision,
    ) -> Vec<(u32, [f64; D])> {
        with!(self, system => system.solve_from_rest(constraints, precision))
    }

    /// Returns the nodes that may move, and all that mass matrices couple to them, sorted.
    pub(crate) fn nodes(&self) -> &[u32] {
        with!(self, system => system.nodes())
    }
}
