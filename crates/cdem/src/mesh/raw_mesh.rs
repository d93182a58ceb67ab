//! A mesh as read from a file or made by a shape, before blocks are cut out of it.

use crate::mesh::{ElementKind, MeshError};

/// Points, cells of dimension 0 to 3, and their physical groups.
///
/// Built by a file reader or a shape, consumed by [`assemble`](fn@crate::mesh::assemble).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawMesh {
    /// Name for messages: a file name, or the shape of a block.
    pub origin: String,
    /// Coordinates in the units of the file; 2-D meshes have a constant z.
    pub points: Vec<[f64; 3]>,
    /// The file's own number of each point, for messages.
    pub point_tags: Vec<u64>,
    /// Cells, one entry per kind that occurs.
    pub cells: Vec<RawCells>,
    /// Physical groups.
    pub groups: Vec<RawGroup>,
    /// Sets of groups that a cell can be in: indices into `groups`, sorted, each once. The first
    /// set is empty.
    pub group_sets: Vec<Vec<u32>>,
}

/// All cells of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawCells {
    /// Their shape.
    pub kind: CellKind,
    /// Indices into [`RawMesh::points`], [`CellKind::node_count`] per cell, in
    /// Gmsh's order.
    pub nodes: Vec<u32>,
    /// The file's own number of each cell, for messages.
    pub tags: Vec<u64>,
    /// Index into [`RawMesh::group_sets`] of each cell.
    pub sets: Vec<u32>,
}

/// A physical group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawGroup {
    /// Dimension of its cells: 0 points, 1 curves, 2 surfaces, 3 volumes.
    pub dimension: usize,
    /// The file's own number.
    pub tag: i32,
    /// Its name; the number as text if the file gives none.
    pub name: String,
}

/// Shape of a cell: of an element or of a piece of a boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CellKind {
    /// One node.
    Point,
    /// Two-node line.
    Line,
    /// A shape that can also be an element.
    Element(ElementKind),
}

impl CellKind {
    /// Returns the number of nodes.
    #[must_use]
    pub const fn node_count(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line => 2,
            Self::Element(kind) => kind.node_count(),
        }
    }

    /// Returns the dimension, 0 to 3.
    #[must_use]
    pub const fn dimension(self) -> usize {
        match self {
            Self::Point => 0,
            Self::Line => 1,
            Self::Element(kind) => kind.dimension(),
        }
    }
}

impl RawMesh {
    /// Creates an empty mesh with the name `origin` for messages.
    #[must_use]
    pub fn new(origin: impl Into<String>) -> Self {
        Self {
            origin: origin.into(),
            group_sets: vec![Vec::new()],
            ..Self::default()
        }
    }

    /// Returns the cells of `kind`, to append to.
    pub fn cells_mut(&mut self, kind: CellKind) -> &mut RawCells {
        let found = self.cells.iter().position(|cells| cells.kind == kind);
        let index = found.unwrap_or_else(|| {
            self.cells.push(RawCells {
                kind,
                nodes: Vec::new(),
                tags: Vec::new(),
                sets: Vec::new(),
            });
            self.cells.len() - 1
        });
        &mut self.cells[index]
    }

    /// Returns the number of cells of `dimension`.
    #[must_use]
    pub fn cell_count(&self, dimension: usize) -> usize {
        let of_dimension = |cells: &&RawCells| cells.kind.dimension() == dimension;
        let cells = self.cells.iter().filter(of_dimension);
        cells.map(|cells| cells.tags.len()).sum()
    }

    /// Checks that all indices are valid.
    ///
    /// # Errors
    /// [`MeshError::Inconsistent`] with the first fault.
    pub fn check(&self) -> Result<(), MeshError> {
        let fault = |problem: String| MeshError::Inconsistent {
            mesh: self.origin.clone(),
            problem,
        };
        if self.point_tags.len() != self.points.len() {
            return Err(fault("points and point tags differ in number".into()));
        }
        for cells in &self.cells {
            let count = cells.tags.len();
            if cells.sets.len() != count || cells.nodes.len() != count * cells.kind.node_count() {
                let kind = cells.kind;
                return Err(fault(format!("the arrays of {kind:?} differ in length")));
            }
            if let Some(node) = cells
                .nodes
                .iter()
                .find(|&&n| n as usize >= self.points.len())
            {
                let points = self.points.len();
                return Err(fault(format!("a cell has point {node} of {points}")));
            }
            if let Some(set) = cells
                .sets
                .iter()
                .find(|&&s| s as usize >= self.group_sets.len())
            {
                return Err(fault(format!(
                    "a cell lies in group set {set}, which does not exist"
                )));
            }
        }
        let known = |set: &Vec<u32>| set.iter().all(|&g| (g as usize) < self.groups.len());
        if !self.group_sets.iter().all(known) {
            return Err(fault("a set names a group that does not exist".into()));
        }
        Ok(())
    }
}
