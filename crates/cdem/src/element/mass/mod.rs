//! Nodal masses, exact for the rigid body (design: bodies, mass).
//!
//! Row-sum lumping alone gives a single triangle 4 times, a single tetrahedron 5 times and a single
//! cube 3 times its rotational inertia. Where possible, factors on the masses correct this;
//! elsewhere the consistent mass matrix of the block does.

pub(crate) mod consistent;
pub(crate) mod fit;
pub(crate) mod inertia;
pub(crate) mod least_change;
#[cfg(test)]
mod tests;

use thiserror::Error;

use crate::element::ElementSet;
pub(crate) use crate::element::mass::consistent::ConsistentMass;
use crate::element::mass::fit::MassFit;
use crate::element::mass::inertia::SecondMoments;
use crate::mesh::Mesh;
use crate::scene::Mass;

/// Every fitted mass is at least this fraction of the lumped one.
pub(crate) const SMALLEST_FACTOR: f64 = 0.3;

/// Relative inertia error above which the mass is corrected, or the user is warned.
pub(crate) const INERTIA_TOLERANCE: f64 = 0.01;

/// Largest number of nodes of a dense matrix. The matrix and its inverse then take 16 MiB, and 8
/// MiB more for each further component that is prescribed at other nodes.
pub(crate) const MAX_CONSISTENT_NODES: usize = 1024;

/// Masses of all nodes of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Masses {
    /// Lumped or fitted mass of each node, kg; row sums of the mass matrix in blocks with
    /// consistent mass.
    pub nodal: Vec<f64>,
    /// Fitted mass over lumped mass of each node; 1 if nothing is fitted.
    pub factor: Vec<f64>,
    /// Consistent mass matrices, ascending by block.
    pub consistent: Vec<ConsistentMass>,
    /// Kind of mass of each block.
    pub kind: Vec<MassKind>,
    /// For each block, the largest relative error of the moments of inertia in use about the
    /// principal axes.
    pub inertia_error: Vec<f64>,
}

/// Kind of mass in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MassKind {
    /// Row sums.
    Lumped,
    /// Row sums times factors that correct the inertia.
    Fitted,
    /// A dense matrix for the block.
    Consistent,
}

/// A block cannot have the requested masses.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("block \"{name}\": {fault}")]
pub struct MassError {
    /// Index in [`Mesh::blocks`].
    pub block: usize,
    /// Name of the block.
    pub name: String,
    /// The fault.
    pub fault: MassFault,
}

/// The fault of the masses of a block, with a remedy.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum MassFault {
    /// No masses of at least 0.3 of the lumped ones have the exact inertia.
    #[error(
        "fitted masses must be at least {SMALLEST_FACTOR} of the lumped mass at each node, and no \
         such masses have the exact inertia: they can correct {} % of the error; use more elements \
         across the block, or mass = \"auto\"",
        (100.0 * corrected).floor()
    )]
    NoFit {
        /// Fraction of the inertia error that such masses can correct.
        corrected: f64,
    },
    /// Too many nodes for a dense matrix.
    #[error(
        "mass = \"consistent\" is for at most {MAX_CONSISTENT_NODES} nodes, because its matrix is \
         dense, but the block has {nodes}; use \"auto\" or \"fitted\", which suit so fine a mesh"
    )]
    TooManyNodes {
        /// Number of nodes of the block.
        nodes: usize,
    },
    /// A node has no mass, or an element is folded.
    #[error(
        "its mass matrix is not positive definite; look for nodes without elements and for \
         elements that are folded or flat"
    )]
    NotPositive,
}

/// Computes the nodal masses of `mesh`, whose elements are in `sets`; `requested` has one entry for
/// each block.
///
/// `auto` takes the fit if factors of at least [`SMALLEST_FACTOR`] give all moments that the nodes
/// can represent, and the inertia to [`INERTIA_TOLERANCE`]. Otherwise it takes the consistent
/// matrix for up to [`MAX_CONSISTENT_NODES`] nodes. With more nodes it takes the best fit and stores
/// its error in `inertia_error`.
///
/// # Errors
/// If a requested mass matrix is impossible: see [`MassFault`].
pub(crate) fn build<const D: usize>(
    mesh: &Mesh<D>,
    sets: &[Box<dyn ElementSet<D>>],
    requested: &[Mass],
) -> Result<Masses, MassError> {
    let nodal = lumped(mesh, sets);
    let mut masses = Masses {
        factor: vec![1.0; nodal.len()],
        consistent: Vec::new(),
        kind: Vec::new(),
        inertia_error: Vec::new(),
        nodal,
    };
    let inertias = inertia::exact(mesh, sets, &masses.nodal);
    for (block, (inertia, &requested)) in inertias.into_iter().zip(requested).enumerate() {
        masses
            .add_block(mesh, sets, block, &inertia, requested)
            .map_err(|fault| MassError {
                block,
                name: mesh.blocks[block].name.clone(),
                fault,
            })?;
    }
    Ok(masses)
}

impl Masses {
    /// Chooses and stores the mass of a block. Its `nodal` masses are still lumped.
    fn add_block<const D: usize>(
        &mut self,
        mesh: &Mesh<D>,
        sets: &[Box<dyn ElementSet<D>>],
        block: usize,
        inertia: &SecondMoments<D>,
        requested: Mass,
    ) -> Result<(), MassFault> {
        let range = mesh.blocks[block].nodes.start as usize..mesh.blocks[block].nodes.end as usize;
        let rest = &mesh.nodes[range.clone()];
        let lumped = &mut self.nodal[range.clone()];
        if !lumped.iter().all(|&mass| mass > 0.0) {
            return Err(MassFault::NotPositive);
        }
        let plain = inertia.error(rest, lumped);
        let (kind, error) = match requested {
            Mass::Lumped => (MassKind::Lumped, plain),
            Mass::Consistent => (MassKind::Consistent, 0.0),
            Mass::Fitted | Mass::Auto => {
                let fit = MassFit::new(inertia, rest, lumped);
                if requested == Mass::Fitted && fit.corrected < 1.0 {
                    let corrected = fit.corrected;
                    return Err(MassFault::NoFit { corrected });
                }
                let masses: Vec<f64> = lumped
                    .iter()
                    .zip(&fit.factors)
                    .map(|(m, factor)| m * factor)
                    .collect();
                let error = inertia.error(rest, &masses);
                let misses = fit.corrected < 1.0 || error > INERTIA_TOLERANCE;
                let dense = requested == Mass::Auto && misses && rest.len() <= MAX_CONSISTENT_NODES;
                if dense {
                    (MassKind::Consistent, 0.0)
                } else {
                    lumped.copy_from_slice(&masses);
                    self.factor[range].copy_from_slice(&fit.factors);
                    (MassKind::Fitted, error)
                }
            }
        };
        if kind == MassKind::Consistent {
            self.consistent
                .push(ConsistentMass::new(mesh, sets, block)?);
        }
        self.kind.push(kind);
        self.inertia_error.push(error);
        Ok(())
    }
}

/// Returns the row sums of the mass matrix, kg.
fn lumped<const D: usize>(mesh: &Mesh<D>, sets: &[Box<dyn ElementSet<D>>]) -> Vec<f64> {
    let mut nodal = vec![0.0; mesh.nodes.len()];
    let mut shares = [0.0; 8];
    for set in sets {
        for i in 0..set.len() {
            set.lumped_mass(i, &mut shares);
            for (&node, share) in set.nodes(mesh, i).iter().zip(shares) {
                nodal[node as usize] += share;
            }
        }
    }
    nodal
}

/// Returns the elements of a set that belong to a block, as a range of the set.
fn in_block<const D: usize>(
    mesh: &Mesh<D>,
    set: &dyn ElementSet<D>,
    block: usize,
) -> std::ops::Range<usize> {
    let elements = &mesh.blocks[block].elements;
    let before = |limit: u32| set.mesh_elements().partition_point(|&e| e < limit);
    before(elements.start)..before(elements.end)
}
