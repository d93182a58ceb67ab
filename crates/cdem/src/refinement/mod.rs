//! Adaptivity, the second scale: elements are bisected around contact points (design, section 6;
//! \[Li2015\], section 5).
//!
//! A [`Forest`](forest::Forest) holds the refined elements of a block; each is the root of a tree
//! of halves. It is rebuilt from the base mesh and the requested sizes, so it depends on these
//! alone and not on earlier forests. Without requests it is empty, and the mesh is the base mesh
//! again.

pub(crate) mod adaptivity;
pub(crate) mod base_mesh;
pub(crate) mod base_model;
pub(crate) mod bisection;
pub(crate) mod checkpoint;
pub(crate) mod composite_mesh;
pub(crate) mod cost_estimate;
pub(crate) mod dimension;
pub(crate) mod forest;
pub(crate) mod impact_history;
pub(crate) mod indicator;
pub(crate) mod interpolation;
pub(crate) mod mass_fit;
pub(crate) mod overlay;
#[cfg(test)]
mod overlay_tests;
pub(crate) mod prolongation;
pub(crate) mod refined_block;
#[cfg(test)]
mod refined_block_tests;
pub(crate) mod rigid_modes;
pub(crate) mod rigid_momenta;
pub(crate) mod simplex_split;
pub(crate) mod state;
#[cfg(test)]
mod tests;
pub(crate) mod transfer;
pub(crate) mod zone;

pub(crate) use crate::refinement::adaptivity::{Adaptivity, BlockChange, ImpactNode};
pub(crate) use crate::refinement::base_mesh::BaseMesh;
pub(crate) use crate::refinement::base_model::{BaseLevels, BaseModel};
#[cfg(test)]
use crate::refinement::bisection::{BisectedSimplex, BisectedTetrahedron, BisectedTriangle};
pub(crate) use crate::refinement::cost_estimate::ASSUMED_SPEED;
#[cfg(test)]
use crate::refinement::forest::Forest;
pub(crate) use crate::refinement::impact_history::Approach;
pub(crate) use crate::refinement::indicator::ImpactPrediction;
pub(crate) use crate::refinement::overlay::{MakeOverlay, Overlay, plane_overlay, solid_overlay};
pub(crate) use crate::refinement::refined_block::RefinedBlock;
pub(crate) use crate::refinement::rigid_modes::RigidModes;
pub(crate) use crate::refinement::rigid_momenta::{MovingBody, RigidMomenta};
pub(crate) use crate::refinement::transfer::{MeshTransfer, predecessors};
