//! Errors of building a model from a scene and its mesh.

use thiserror::Error;

use crate::element::mass::MassError;
use crate::math::format::short;
use crate::mesh::MeshError;
use crate::scene::Problem;

/// The reason why a scene and its mesh give no model.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A group that the scene names is missing or unusable.
    #[error("{source}")]
    Group {
        /// Key of the scene, e.g. `boundary[0].group`.
        key: String,
        /// The error.
        source: MeshError,
    },
    /// The mesh data are not a valid mesh.
    #[error("the mesh is not valid: {0}")]
    Unsound(&'static str),
    /// Block names that refer to no part of the mesh.
    #[error("{}", list(.0))]
    UnknownBlocks(Vec<Problem>),
    /// A load needs facets.
    #[error(
        "group \"{group}\" has no boundary facets of a block that can move; a load needs \
         a physical group of edges (2-D) or faces (3-D) on the boundary, or of elements with such \
         facets"
    )]
    NoFacets {
        /// Key of the scene.
        key: String,
        /// Name of the group.
        group: String,
    },
    /// A block is both prescribed and fixed.
    #[error(
        "block \"{block}\" is fixed and cannot follow a boundary condition; leave out `fixed` or \
         the boundary condition"
    )]
    FixedBoundary {
        /// Key of the scene.
        key: String,
        /// Name of the block.
        block: String,
    },
    /// The masses cannot be computed.
    #[error("{source}")]
    Mass {
        /// Key of the scene, e.g. `block[2].mass`.
        key: String,
        /// The error.
        source: MassError,
    },
    /// Blocks overlap at the start.
    #[error(
        "blocks \"{}\" and \"{}\" overlap at {} by {} m, more than the contact tolerance of \
         {} m; move one of them (`translate`), or give the pair no contact (`[[contact.pair]]` \
         with `enabled = false`){}",
        blocks[0], blocks[1], place(at), short(*depth), short(*tolerance),
        if *depth <= RAISABLE * edge { ", or raise `contact.tolerance`" } else { "" }
    )]
    Overlap {
        /// Key of the scene for the second of the two blocks.
        key: String,
        /// Names of the two blocks.
        blocks: [String; 2],
        /// Point of the overlap, m.
        at: [f64; 3],
        /// Penetration, m.
        depth: f64,
        /// Contact tolerance, m.
        tolerance: f64,
        /// Smallest boundary edge, m.
        edge: f64,
    },
    /// The contact tolerance joins points that are an edge apart.
    #[error(
        "{} m is more than {} m, half of the smallest boundary edge: nodes at the two ends of an \
         edge would touch the same points; choose a smaller value, or leave it out",
        short(*tolerance), short(0.5 * edge)
    )]
    Tolerance {
        /// Contact tolerance, m.
        tolerance: f64,
        /// Smallest boundary edge, m.
        edge: f64,
    },
    /// Two boundary conditions give a node different velocities.
    #[error(
        "it prescribes another velocity of node {node} of block \"{block}\" along {axis} than \
         boundary[{earlier}]; remove the node from one of the groups, or leave out that component"
    )]
    Contradiction {
        /// Key of the scene for the later of the two.
        key: String,
        /// Index of the earlier boundary condition.
        earlier: usize,
        /// Index of the node in its block.
        node: u32,
        /// Name of the block.
        block: String,
        /// x, y or z.
        axis: char,
    },
    /// No step is short enough for an element.
    #[error(
        "block \"{block}\", element {element} at {}: it has no usable stable step ({} s); \
         the material is too stiff, too light or too damped: check the units of \
         `young_modulus`, `density` and `damping`, and the size of the mesh",
        place(at), short(*limit)
    )]
    Unstable {
        /// Key of the scene, e.g. `block[2].material`.
        key: String,
        /// Name of the block.
        block: String,
        /// Index of the element in its block.
        element: u32,
        /// Its first node, m.
        at: [f64; 3],
        /// Its stable step, s.
        limit: f64,
    },
    /// An element needs a finer level than there is.
    #[error(
        "block \"{block}\", element {element} at {}: its stable step, {} s, needs time level \
         {needed} of a coarse step of {} s, but the finest is 16; choose a smaller `time.step`, or \
         look for a flat element in the mesh there",
        place(at), short(*limit), short(*step)
    )]
    TooFine {
        /// Name of the block.
        block: String,
        /// Index of the element in its block.
        element: u32,
        /// Its first node, m.
        at: [f64; 3],
        /// Its stable step, s.
        limit: f64,
        /// The level it needs.
        needed: u32,
        /// The coarse step, s.
        step: f64,
    },
    /// The run would take more steps than can be counted.
    #[error(
        "{} steps of {} s to t = {} s are too many; increase `time.step` or reduce `time.end`",
        short(*count), short(*step), short(*end)
    )]
    TooManySteps {
        /// Number of steps.
        count: f64,
        /// Length of a step, s.
        step: f64,
        /// End of the run, s.
        end: f64,
    },
    /// A start velocity that no body can have; its energy may not be a number.
    #[error(
        "block \"{block}\" starts at {} m/s, faster than light; check the units of its \
         `velocity` and `angular_velocity`, and of the boundary conditions at t = 0",
        short(*speed)
    )]
    TooFast {
        /// Key of the scene, e.g. `block[2].velocity`.
        key: String,
        /// Name of the block.
        block: String,
        /// Speed of its fastest node, m/s.
        speed: f64,
    },
    /// All blocks are fixed.
    #[error("all blocks of the scene are fixed; at least one must be free to move")]
    NothingMoves,
}

/// Fraction of the smallest boundary edge. A penetration up to it may be intended, as the contact
/// tolerance of meshes that do not fit exactly.
const RAISABLE: f64 = 0.1;

/// Returns one line for each problem.
fn list(problems: &[Problem]) -> String {
    let lines = problems.iter().map(Problem::to_string);
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns a point as text.
fn place(at: &[f64; 3]) -> String {
    crate::mesh::coordinates(at)
}

impl ModelError {
    /// Returns the key of the scene that caused the error, if there is one: a path such as
    /// `boundary[0].group`. The keys of unknown blocks are in their problems.
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
