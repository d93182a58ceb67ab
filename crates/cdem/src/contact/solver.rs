//! The solver of an island, with packs as wide as its masses couple nodes.

use crate::contact::pack::{OfBlock, OfNode};
use crate::contact::solve::Constraint;
use crate::contact::system::System;
use crate::model::inertia::Mobility;

/// Contacts that share nodes, solved together.
#[derive(Clone, Debug)]
pub(crate) enum Solver<const D: usize> {
    /// No mass matrix couples nodes that contacts move.
    OfNodes(System<D, OfNode>),
    /// One does, or more.
    OfBlocks(System<D, OfBlock>),
}

impl<const D: usize> Default for Solver<D> {
    fn default() -> Self {
        Self::OfNodes(System::default())
    }
}

impl<const D: usize> Solver<D> {
    /// Takes the geometry of the constraints.
    pub(crate) fn load(&mut self, constraints: &[Constraint<D>], mobility: Mobility<D>) {
        let couples = |node: &u32| {
            let node = *node as usize;
            mobility.inertia.is_dense(node) && !mobility.inertia.is_held(node)
        };
        let mut operators = constraints.iter().map(|constraint| &constraint.operator);
        let couples = operators.any(|operator| operator.nodes().iter().any(couples));
        if couples != matches!(self, Self::OfBlocks(_)) {
            *self = if couples {
                Self::OfBlocks(System::default())
            } else {
                Self::OfNodes(System::default())
            };
        }
        match self {
            Self::OfNodes(system) => system.load(constraints, mobility),
            Self::OfBlocks(system) => system.load(constraints, mobility),
        }
    }

    /// Finds the impulses of the constraints that were loaded and adds them to the velocities,
    /// m/s, as [`System::solve`] says. Returns the residual.
    pub(crate) fn solve(
        &mut self,
        constraints: &mut [Constraint<D>],
        velocity: &mut [[f64; D]],
        precision: (f64, f64),
    ) -> f64 {
        match self {
            Self::OfNodes(system) => system.solve(constraints, velocity, precision),
            Self::OfBlocks(system) => system.solve(constraints, velocity, precision),
        }
    }

    /// The same for nodes at rest: those that are moved, and their velocities, m/s.
    pub(crate) fn solve_from_rest(
        &mut self,
        constraints: &[Constraint<D>],
        least: f64,
    ) -> Vec<(u32, [f64; D])> {
        match self {
            Self::OfNodes(system) => system.solve_from_rest(constraints, least),
            Self::OfBlocks(system) => system.solve_from_rest(constraints, least),
        }
    }

    /// Nodes that may be moved, and all that mass matrices couple to these, sorted.
    pub(crate) fn nodes(&self) -> &[u32] {
        match self {
            Self::OfNodes(system) => system.nodes(),
            Self::OfBlocks(system) => system.nodes(),
        }
    }
}
