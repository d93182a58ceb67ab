//! Meshes of one or many blocks: what the model is built from.

mod kind;

use std::ops::Range;

pub use kind::ElementKind;

/// The mesh of all blocks of a scene, placed and checked.
///
/// Blocks share no nodes; nodes and elements of a block are contiguous.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh<const D: usize> {
    /// Rest positions, m.
    pub nodes: Vec<[f64; D]>,
    /// Elements, grouped by block.
    pub elements: Vec<Element>,
    /// Blocks in the order of the scene, parts of a split block in a row.
    pub blocks: Vec<Block>,
    /// Named sets of nodes and boundary facets, sorted by name.
    pub groups: Vec<Group>,
}

/// One finite element: its kind and its nodes in Gmsh's (= VTK's) order, with
/// positive Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Element {
    /// Shape.
    pub kind: ElementKind,
    /// Global node numbers; only the first `kind.node_count()` are used.
    pub nodes: [u32; 8],
}

impl Element {
    /// An element of `kind` on `nodes`; extra room is filled with `u32::MAX`.
    #[must_use]
    pub fn new(kind: ElementKind, nodes: &[u32]) -> Self {
        let mut all = [u32::MAX; 8];
        all[..kind.node_count()].copy_from_slice(&nodes[..kind.node_count()]);
        Self { kind, nodes: all }
    }

    /// The nodes in use.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.kind.node_count()]
    }
}

/// A connected or unconnected body that moves and deforms on its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Name: that of the scene's block, with `.1`, `.2`, … for parts of a split.
    pub name: String,
    /// Index of the scene's `[[block]]` it comes from.
    pub source: usize,
    /// Its nodes in [`Mesh::nodes`].
    pub nodes: Range<u32>,
    /// Its elements in [`Mesh::elements`].
    pub elements: Range<u32>,
}

/// A facet of an element: an edge in 2-D, a face in 3-D.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Facet {
    /// Index into [`Mesh::elements`].
    pub element: u32,
    /// Index into [`ElementKind::facets`] of the element's kind.
    pub local: u8,
}

/// A named set, from a physical group of a mesh file or a side of a shape.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// Physical name, or `block.xmin` and the like for shapes.
    pub name: String,
    /// Nodes, sorted, each once.
    pub nodes: Vec<u32>,
    /// Boundary facets, sorted, each once; empty for groups of points.
    pub facets: Vec<Facet>,
}
