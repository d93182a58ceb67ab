//! Why a scene and its mesh make no model.

use thiserror::Error;

use crate::element::mass::MassError;
use crate::math::format::short;
use crate::mesh::MeshError;
use crate::scene::Problem;

/// Why a scene and its mesh make no model.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A group that the scene names is not there or not usable.
    #[error("{source}")]
    Group {
        /// Key of the scene, e.g. `boundary[0].group`.
        key: String,
        /// What is wrong.
        source: MeshError,
    },
    /// What was given for a mesh is none.
    #[error("the mesh is not whole: {0}")]
    Unsound(&'static str),
    /// Names of blocks that mean no part of the mesh.
    #[error("{}", list(.0))]
    UnknownBlocks(Vec<Problem>),
    /// A load needs facets.
    #[error(
        "group \"{group}\" has no boundary facets of a block that may move; a load acts on \
         a physical group of edges (2-D) or faces (3-D) on the boundary, or of elements that have some"
    )]
    NoFacets {
        /// Key of the scene.
        key: String,
        /// Name of the group.
        group: String,
    },
    /// Prescribed and fixed at once.
    #[error(
        "block \"{block}\" is fixed and cannot follow a boundary condition; drop `fixed`, or the boundary condition"
    )]
    FixedBoundary {
        /// Key of the scene.
        key: String,
        /// Name of the block.
        block: String,
    },
    /// Masses cannot be made.
    #[error("{source}")]
    Mass {
        /// Key of the scene, e.g. `block[2].mass`.
        key: String,
        /// What is wrong.
        source: MassError,
    },
    /// Blocks overlap at the start.
    #[error(
        "blocks \"{}\" and \"{}\" overlap at {} by {} m, more than the contact tolerance of \
         {} m; move one of them (`translate`){}",
        blocks[0], blocks[1], place(at), short(*depth), short(*tolerance),
        if *depth <= RAISABLE * edge { ", or raise `contact.tolerance`" } else { "" }
    )]
    Overlap {
        /// Key of the scene: the second of the two.
        key: String,
        /// Names of the two.
        blocks: [String; 2],
        /// Where, m.
        at: [f64; 3],
        /// How deep, m.
        depth: f64,
        /// How deep they may, m.
        tolerance: f64,
        /// Smallest boundary edge, m.
        edge: f64,
    },
    /// Points touch that are an edge apart.
    #[error(
        "{} m is more than {} m, half of the smallest boundary edge: nodes would \
         touch that are an edge apart; choose less, or leave it out",
        short(*tolerance), short(0.5 * edge)
    )]
    Tolerance {
        /// Distance within which points touch, m.
        tolerance: f64,
        /// Smallest boundary edge, m.
        edge: f64,
    },
    /// Two boundary conditions want different things of a node.
    #[error(
        "it gives node {node} of block \"{block}\" another velocity than boundary[{earlier}] does, \
         along {axis}; take the node out of one group, or leave out that component"
    )]
    Contradiction {
        /// Key of the scene: the later of the two.
        key: String,
        /// Number of the earlier boundary condition.
        earlier: usize,
        /// Number of the node in its block.
        node: u32,
        /// Name of the block.
        block: String,
        /// x, y or z.
        axis: char,
    },
    /// An element that no step is short enough for.
    #[error(
        "block \"{block}\", element {element} at {}: no step is short enough for it (its limit comes \
         to {} s); its material is too stiff, too light or too damped: check the units of \
         `young_modulus`, `density` and `damping`, and the size of the mesh",
        place(at), short(*limit)
    )]
    Unstable {
        /// Key of the scene, e.g. `block[2].material`.
        key: String,
        /// Name of the block.
        block: String,
        /// Number of the element in its block.
        element: u32,
        /// Its first node, m.
        at: [f64; 3],
        /// Its stable step, s.
        limit: f64,
    },
    /// An element needs more levels than there are.
    #[error(
        "block \"{block}\", element {element} at {} is stable up to {} s only: level {needed} \
         of a step of {} s, and there are 16; take a smaller `time.step`, or mend the mesh \
         there (a sliver?)",
        place(at), short(*limit), short(*step)
    )]
    TooFine {
        /// Name of the block.
        block: String,
        /// Number of the element in its block.
        element: u32,
        /// Its first node, m.
        at: [f64; 3],
        /// Its stable step, s.
        limit: f64,
        /// The level it needs.
        needed: u32,
        /// The coarsest step, s.
        step: f64,
    },
    /// The run would take more steps than can be counted.
    #[error(
        "{} steps of {} s to t = {} s are too many; raise `time.step` or lower `time.end`",
        short(*count), short(*step), short(*end)
    )]
    TooManySteps {
        /// Steps.
        count: f64,
        /// Their length, s.
        step: f64,
        /// End of the run, s.
        end: f64,
    },
    /// A start that no body can have; its energy may not be a number.
    #[error(
        "block \"{block}\" starts at {} m/s, faster than light; check the units of \
         `velocity` and `angular_velocity`, and of what is prescribed at t = 0",
        short(*speed)
    )]
    TooFast {
        /// Key of the scene, e.g. `block[2].velocity`.
        key: String,
        /// Name of the block.
        block: String,
        /// Its fastest node, m/s.
        speed: f64,
    },
    /// Nothing to run.
    #[error("the scene has no block that may move")]
    NothingMoves,
}

/// Share of the smallest boundary edge up to which a deeper overlap may be meant:
/// the tolerance of a mesh that fits badly.
const RAISABLE: f64 = 0.1;

/// A line for each problem.
fn list(problems: &[Problem]) -> String {
    let lines = problems.iter().map(Problem::to_string);
    lines.collect::<Vec<_>>().join("\n")
}

/// A point as text.
fn place(at: &[f64; 3]) -> String {
    crate::mesh::coordinates(at)
}

impl ModelError {
    /// The key of the scene that is to blame, where there is one: a path such
    /// as `boundary[0].group`. Unknown blocks have theirs in their problems.
    #[must_use]
    pub fn key(&self) -> Option<&str> {
        match self {
            Self::Group { key, .. }
            | Self::NoFacets { key, .. }
            | Self::FixedBoundary { key, .. }
            | Self::TooFast { key, .. }
            | Self::Overlap { key, .. }
            | Self::Contradiction { key, .. }
            | Self::Unstable { key, .. }
            | Self::Mass { key, .. } => Some(key),
            Self::TooFine { .. } | Self::TooManySteps { .. } => Some("time.step"),
            Self::Tolerance { .. } => Some("contact.tolerance"),
            Self::UnknownBlocks(_) | Self::Unsound(_) => None,
            Self::NothingMoves => Some("block[0].fixed"),
        }
    }
}
