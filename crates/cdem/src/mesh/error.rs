//! Errors of meshes, worded for the user who must correct the mesh.

use std::path::PathBuf;

use thiserror::Error;

use crate::math::format::short;

/// Error of a mesh.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file cannot be read.
    #[error("mesh {}: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// The file violates its format.
    #[error("{mesh}: {section}, {place}: {problem}; {help}")]
    Format {
        /// The file.
        mesh: String,
        /// Section of the file.
        section: String,
        /// Line, or byte offset in binary parts.
        place: String,
        /// Problem: found and expected content.
        problem: String,
        /// Advice.
        help: String,
    },
    /// Arrays of a [`RawMesh`](crate::mesh::RawMesh) do not fit together.
    #[error("{mesh}: {problem}; the program that made this mesh is at fault")]
    Inconsistent {
        /// The mesh.
        mesh: String,
        /// The mismatch.
        problem: String,
    },
    /// A block cannot be made from its mesh or shape.
    #[error("block \"{block}\" ({mesh}): {fault}")]
    Block {
        /// The block of the scene.
        block: String,
        /// The mesh or shape of the block.
        mesh: String,
        /// The error.
        fault: Box<BlockFault>,
    },
    /// No group of the placed mesh has this name.
    #[error(
        "no group \"{name}\"; {}",
        groups(
            nearest,
            known,
            "",
            "make physical groups in Gmsh, use a side of a shape such as \"floor.ymax\", or, for a \
         boundary condition, name a `block`"
        )
    )]
    UnknownGroup {
        /// The name asked for.
        name: String,
        /// The most similar name.
        nearest: Option<String>,
        /// All names, sorted.
        known: Vec<String>,
    },
    /// Several different groups have this name.
    #[error(
        "the name \"{name}\" stands for several groups: {}; give them different names in the \
         mesh, or, if they belong to different blocks, add the block, as in \"block.{name}\"",
        origins.join(", and ")
    )]
    AmbiguousGroup {
        /// The name asked for.
        name: String,
        /// Origins of the groups with this name.
        origins: Vec<String>,
    },
    /// The group exists in a mesh file, but on none of the blocks.
    #[error(
        "group \"{name}\" ({origin}) has no part on any block; choose another group, \
         or add a block for its part of the mesh"
    )]
    EmptyGroup {
        /// The name asked for.
        name: String,
        /// Origin of the group.
        origin: String,
    },
}

/// Error of one block's mesh.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum BlockFault {
    /// `block.group` names no physical group.
    #[error(
        "no physical group \"{group}\"; {}",
        groups(nearest, known, &format!(" of {cells}"), "leave out `group` to use the whole mesh")
    )]
    UnknownGroup {
        /// The name asked for.
        group: String,
        /// Kind of the group's parts: surfaces in 2-D, volumes in 3-D.
        cells: &'static str,
        /// The most similar name.
        nearest: Option<String>,
        /// All names of that dimension, sorted.
        known: Vec<String>,
    },
    /// The group has the wrong dimension.
    #[error("physical group \"{group}\" consists of {found}, but a block is made of {expected}")]
    GroupDimension {
        /// The group.
        group: String,
        /// Its parts.
        found: &'static str,
        /// The expected parts.
        expected: &'static str,
    },
    /// The mesh or group has no elements for a block.
    #[error("{what} has no {dimension}-D elements; {}", present.advice(*dimension))]
    Empty {
        /// The mesh or the group.
        what: String,
        /// Dimension of the scene.
        dimension: usize,
        /// The elements of the file.
        present: PresentCells,
    },
    /// A 2-D mesh does not lie in a plane z = constant.
    #[error(
        "node {node} at z = {} lies out of the plane z = {} of the others; \
         a 2-D mesh lies in the x-y plane: rotate it, or set dimension = 3",
        short(*z), short(*plane)
    )]
    NotPlanar {
        /// The file's number of the node.
        node: u64,
        /// Its z, in the file's units.
        z: f64,
        /// z of the first node.
        plane: f64,
    },
    /// A coordinate is not finite, or so large that its square will overflow.
    #[error(
        "node {node} at {} is not within {} m of the origin; check the mesh, scale and translate",
        coordinates(at),
        short(FARTHEST)
    )]
    NotFinite {
        /// The file's number of the node.
        node: u64,
        /// Its coordinates.
        at: Vec<f64>,
    },
    /// An element is so far from the origin that its nodes can hardly be told apart.
    #[error(
        "{kind} element {element} near {} is {} m large, but floating-point numbers there are {} m \
         apart; move the block nearer to the origin (translate), or check its units (scale)",
        coordinates(at), short(*size), short(*spacing)
    )]
    Blurred {
        /// Shape of the element.
        kind: &'static str,
        /// The file's number of the element.
        element: u64,
        /// Its centre.
        at: Vec<f64>,
        /// Its extent, m.
        size: f64,
        /// Distance between neighbouring floating-point numbers there, m.
        spacing: f64,
    },
    /// An element without area or volume.
    #[error(
        "{kind} element {element} near {} has no {}; its nodes lie on a line or in a plane: \
         remove it or move a node", coordinates(at), if *dimension == 2 { "area" } else { "volume" }
    )]
    Flat {
        /// Shape of the element.
        kind: &'static str,
        /// The file's number of the element.
        element: u64,
        /// Its centre.
        at: Vec<f64>,
        /// 2 or 3.
        dimension: usize,
    },
    /// An element uses a node twice.
    #[error(
        "{kind} element {element} near {} has node {node} twice; correct its nodes, or {}",
        coordinates(at),
        if matches!(*kind, "tri3" | "tet4") { "remove it" } else { "make it a simplex" }
    )]
    Repeated {
        /// Shape of the element.
        kind: &'static str,
        /// The file's number of the element.
        element: u64,
        /// The file's number of the node.
        node: u64,
        /// Its centre.
        at: Vec<f64>,
    },
    /// An element has an edge or diagonal of zero length.
    #[error(
        "{kind} element {element} near {} has two nodes at one place; make it a simplex, or \
         move one of them",
        coordinates(at)
    )]
    Collapsed {
        /// Shape of the element.
        kind: &'static str,
        /// The file's number of the element.
        element: u64,
        /// Its centre.
        at: Vec<f64>,
    },
    /// The Jacobian of an element changes sign.
    #[error(
        "{kind} element {element} near {} is folded: its Jacobian changes sign \
         ({negative} of {points} Gauss points); move its nodes until it is convex, \
         or use simplices",
        coordinates(at)
    )]
    Folded {
        /// Shape of the element.
        kind: &'static str,
        /// The file's number of the element.
        element: u64,
        /// Its centre.
        at: Vec<f64>,
        /// Gauss points with a negative Jacobian.
        negative: usize,
        /// All Gauss points.
        points: usize,
    },
    /// Two elements have the same nodes.
    #[error(
        "elements {first} and {second} near {} have the same nodes; remove one of them \
         (in Gmsh: Coherence Mesh, or remove a surface or volume that exists twice)",
        coordinates(at)
    )]
    Duplicate {
        /// The file's number of the first.
        first: u64,
        /// The file's number of the second.
        second: u64,
        /// Their centre.
        at: Vec<f64>,
    },
    /// Elements overlap at a facet.
    #[error(
        "elements {} near {} overlap at a common facet: at most two elements may share a \
         facet, one on each side; correct surfaces or volumes that overlap in the geometry",
        numbers(elements),
        coordinates(at)
    )]
    Overlapping {
        /// The file's numbers of the elements.
        elements: Vec<u64>,
        /// Centre of the facet.
        at: Vec<f64>,
    },
    /// A shape cannot be made.
    #[error("{key}: {problem}")]
    Shape {
        /// Key of the scene, below the block.
        key: &'static str,
        /// Problem and advice.
        problem: String,
    },
    /// The name of a part is that of another block.
    #[error(
        "a part of this block would have the name \"{name}\" of another block; rename one of them"
    )]
    NameTaken {
        /// The name.
        name: String,
    },
    /// There are more nodes or elements than 32-bit numbers for them.
    #[error("more than {limit} nodes or elements in all blocks; use a coarser mesh")]
    TooLarge {
        /// The limit.
        limit: u32,
    },
}

impl BlockFault {
    /// Returns the key at fault below the scene's block, e.g. `shape.size`; `None` if it is the
    /// mesh or shape as a whole.
    #[must_use]
    pub fn key(&self) -> Option<&str> {
        match self {
            Self::UnknownGroup { .. } | Self::GroupDimension { .. } => Some("group"),
            Self::Shape { key, .. } => Some(key),
            Self::NameTaken { .. } => Some("name"),
            _ => None,
        }
    }

    /// Returns the error with its block and mesh.
    pub(super) fn of(self, block: &str, mesh: &str) -> MeshError {
        MeshError::Block {
            block: block.to_owned(),
            mesh: mesh.to_owned(),
            fault: Box::new(self),
        }
    }
}

/// Largest coordinate of a node, m; areas far beyond it overflow.
pub(super) const FARTHEST: f64 = 1e100;

/// Elements of a mesh file that has none for a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresentCells {
    /// No elements.
    Nothing,
    /// Points or lines alone.
    PointsOrLines,
    /// Elements for a scene of this dimension.
    OfDimension(usize),
    /// 2-D elements out of one plane, for a 3-D scene.
    SurfaceInSpace,
    /// This number of elements of the scene's dimension, none of them in a physical group.
    WithoutGroups(usize),
    /// This number of elements of the scene's dimension, in other groups.
    InOtherGroups(usize),
}

impl PresentCells {
    /// Returns the advice for a scene of this dimension.
    fn advice(self, dimension: usize) -> String {
        let mesh = format!(
            "make a mesh of that dimension (gmsh -{dimension}), and save physical groups of that \
             dimension or use Mesh.SaveAll = 1"
        );
        match self {
            Self::Nothing => mesh,
            Self::PointsOrLines => format!("{mesh}; it has only points or lines"),
            Self::OfDimension(other) => format!(
                "{mesh}; or set dimension = {other} in the scene to use its {other}-D elements"
            ),
            Self::SurfaceInSpace => "it is a surface, and a block is a volume: in Gmsh, extrude \
                 the surface, or close it to a surface loop and fill it with a volume, then make \
                 a mesh of the volume (gmsh -3)"
                .to_owned(),
            Self::WithoutGroups(count) => format!(
                "the file has {count} of them, but none belongs to a physical group: MSH 2.2 with \
                 Mesh.SaveAll = 1 writes none; set it to 0, or write version 4.1 \
                 (Mesh.MshFileVersion = 4.1)"
            ),
            Self::InOtherGroups(count) => format!(
                "the file has {count} of them outside this group; add elements to the group in \
                 Gmsh, or choose another group"
            ),
        }
    }
}

/// Returns coordinates as text, with six significant digits at most.
pub(crate) fn coordinates(at: &[f64]) -> String {
    let all: Vec<_> = at.iter().map(|&x| short(x)).collect();
    format!("({})", all.join(", "))
}

/// Returns the name in `known` most similar to `name`, if one is similar enough.
pub(super) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let rated = known.map(|other| (strsim::damerau_levenshtein(name, other), other));
    let (distance, best) = rated.min()?;
    (distance <= name.chars().count().div_ceil(2)).then(|| best.to_owned())
}

/// Returns advice on an unknown group: the `nearest` name, the names in `known`, or, if there are
/// none, `otherwise`.
fn groups(nearest: &Option<String>, known: &[String], of: &str, otherwise: &str) -> String {
    let all = list(known);
    match nearest {
        Some(name) => format!("did you mean \"{name}\"? The groups{of} are: {all}"),
        None if known.is_empty() => format!("there are no groups{of}: {otherwise}"),
        None => format!("the groups{of} are: {all}"),
    }
}

/// Largest number of names listed in a message.
const LISTED: usize = 20;

fn list(names: &[String]) -> String {
    let quoted: Vec<_> = names
        .iter()
        .take(LISTED)
        .map(|n| format!("\"{n}\""))
        .collect();
    let rest = names.len().saturating_sub(LISTED);
    let more = if rest > 0 {
        format!(" and {rest} more")
    } else {
        String::new()
    };
    quoted.join(", ") + &more
}

fn numbers(elements: &[u64]) -> String {
    let all: Vec<_> = elements.iter().take(LISTED).map(u64::to_string).collect();
    all.join(", ")
}
