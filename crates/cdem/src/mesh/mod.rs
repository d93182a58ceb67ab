//! Meshes of one or many blocks, from which the model is built.

pub(crate) mod assemble;
pub(crate) mod box_tree;
pub(crate) mod coincident;
pub(crate) mod conformity;
pub(crate) mod error;
pub(crate) mod facet;
pub(crate) mod member;
pub(crate) mod notes;
pub(crate) mod order;
pub(crate) mod overlap;
pub(crate) mod placement;
pub(crate) mod quality;
pub(crate) mod raw_mesh;
pub(crate) mod shape;
pub(crate) mod simplex;
pub(crate) mod source;
pub(crate) mod split;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod validate;
pub(crate) mod vector;

use serde::{Deserialize, Serialize};

pub(crate) use crate::mesh::simplex::distance_to;

use std::borrow::Cow;
use std::ops::Range;

pub use crate::mesh::assemble::assemble;
pub(crate) use crate::mesh::error::coordinates;
pub use crate::mesh::error::{BlockFault, MeshError, PresentCells};
pub use crate::mesh::overlap::{Overlap, overlap};
pub(crate) use crate::mesh::quality::volume;
pub use crate::mesh::raw_mesh::{CellKind, RawCells, RawGroup, RawMesh};
pub(crate) use crate::scene::element_kind::CORNERS;
pub use crate::scene::element_kind::ElementKind;

/// The mesh of all blocks of a scene, placed and checked.
///
/// Blocks share no nodes; nodes and elements of a block are contiguous.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh<const D: usize> {
    /// Rest positions, m.
    #[serde(with = "crate::math::serde_pod")]
    pub nodes: Vec<[f64; D]>,
    /// Elements, grouped by block.
    pub elements: Vec<Element>,
    /// Blocks in the order of the scene; the parts of a split block are consecutive.
    pub blocks: Vec<MeshBlock>,
    /// Named sets of nodes and boundary facets, sorted by name. Several may share a name, so look
    /// them up with [`Mesh::group`].
    pub groups: Vec<Group>,
    /// Notes for the user on things that are not errors.
    pub notes: Vec<String>,
    /// Origins of the elements, if some are refined.
    #[serde(skip)]
    pub(crate) parts: Option<ElementOrigins>,
    /// Boundary facets, sorted; set once the elements no longer change.
    #[serde(skip)]
    pub(crate) boundary: Known<Vec<Facet>>,
}

/// Cached value derived from the rest of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known<T>(pub(crate) Option<T>);

impl<T> PartialEq for Known<T> {
    /// Always true: the value follows from the rest of the mesh.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Origins of the elements of a refined mesh, with the data that the elements do not hold. Elements
/// of the two scales may overlap.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ElementOrigins {
    /// The base-mesh element that each element is, or is a part of.
    pub(crate) root: Vec<u32>,
    /// Fraction of its volume that each element stands for.
    pub(crate) weight: Vec<f64>,
    /// Number of halvings in size from the root to each element.
    pub(crate) halvings: Vec<u8>,
}

impl<const D: usize> Mesh<D> {
    /// Returns the group called `name`. With `block.name`, returns the part of the group on that
    /// block.
    ///
    /// # Errors
    /// If there is none (with the most similar name), if several different groups of the mesh files
    /// have the name, or if it lies on no block.
    pub fn group(&self, name: &str) -> Result<Cow<'_, Group>, MeshError> {
        let named = || self.groups.iter().filter(|group| group.name == name);
        let mut found: Vec<_> = named().map(Cow::Borrowed).collect();
        if found.is_empty() {
            found.extend(self.groups_at_blocks(name).map(Cow::Owned));
        }
        if found.is_empty() {
            let mut known: Vec<_> = self.groups.iter().map(|g| g.name.clone()).collect();
            known.dedup();
            return Err(MeshError::UnknownGroup {
                name: name.to_owned(),
                nearest: error::nearest(name, known.iter().map(String::as_str)),
                known,
            });
        }
        let origin = found[0].origin.clone();
        found.retain(|group| !group.nodes.is_empty());
        if found.len() > 1 {
            return Err(MeshError::AmbiguousGroup {
                name: name.to_owned(),
                origins: found.iter().map(|g| g.origin.clone()).collect(),
            });
        }
        found.pop().ok_or_else(|| MeshError::EmptyGroup {
            name: name.to_owned(),
            origin,
        })
    }

    /// Returns the parts of groups on blocks for a name of block and group with a dot between them.
    /// The parts of a split block count as one block.
    fn groups_at_blocks(&self, name: &str) -> impl Iterator<Item = Group> {
        let dots = name.match_indices('.');
        let pairs = dots.map(|(dot, _)| (&name[..dot], &name[dot + 1..]));
        pairs.flat_map(|(block, name)| {
            let (nodes, elements) = self.extent(block);
            let named = self.groups.iter().filter(move |group| group.name == name);
            let is_there = !nodes.is_empty();
            named
                .filter(move |_| is_there)
                .map(move |group| group.within(&nodes, &elements))
        })
    }

    /// Returns the nodes and elements of a block, or of all parts of a split one, which are
    /// consecutive; empty if there is no such block.
    fn extent(&self, name: &str) -> (Range<u32>, Range<u32>) {
        let mut parts: Vec<&MeshBlock> = self.blocks.iter().filter(|b| b.name == name).collect();
        if parts.is_empty() {
            let first = self.blocks.iter().find(|block| block.is_part_of(name));
            let is_beside = |block: &&MeshBlock| first.is_some_and(|b| b.source == block.source);
            parts.extend(self.blocks.iter().filter(is_beside));
        }
        match parts.as_slice() {
            [] => (0..0, 0..0),
            [first, ..] => {
                let last = parts[parts.len() - 1];
                let nodes = first.nodes.start..last.nodes.end;
                (nodes, first.elements.start..last.elements.end)
            }
        }
    }
}

impl<const D: usize> Mesh<D> {
    /// Returns the number of halvings in size of an element.
    pub(crate) fn halvings(&self, element: usize) -> u8 {
        let parts = self.parts.as_ref();
        parts.map_or(0, |parts| parts.halvings[element])
    }

    /// Returns the halvings of the finest element at each node.
    pub(crate) fn halvings_at_nodes(&self) -> Vec<u8> {
        let mut halvings = vec![0; self.nodes.len()];
        for (number, element) in self.elements.iter().enumerate() {
            for &node in element.nodes() {
                let of_node: &mut u8 = &mut halvings[node as usize];
                *of_node = self.halvings(number).max(*of_node);
            }
        }
        halvings
    }
}

/// A finite element: its kind and its nodes in the order of Gmsh (= VTK), with positive Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Element {
    /// Shape.
    pub kind: ElementKind,
    /// Global node numbers; only the first `kind.node_count()` are used.
    pub nodes: [u32; 8],
}

impl Element {
    /// Creates an element of `kind` on `nodes`; unused entries are `u32::MAX`.
    #[must_use]
    pub fn new(kind: ElementKind, nodes: &[u32]) -> Self {
        let mut all = [u32::MAX; 8];
        all[..kind.node_count()].copy_from_slice(&nodes[..kind.node_count()]);
        Self { kind, nodes: all }
    }

    /// Returns the nodes in use.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.kind.node_count()]
    }
}

/// A body that moves and deforms on its own; its mesh need not be connected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshBlock {
    /// Name: that of the scene's block, with `.1`, `.2`, … for the parts of a split.
    pub name: String,
    /// Index of the scene's `[[block]]`.
    pub source: usize,
    /// Range of its nodes in [`Mesh::nodes`].
    pub nodes: Range<u32>,
    /// Range of its elements in [`Mesh::elements`].
    pub elements: Range<u32>,
}

impl MeshBlock {
    /// True if this is a part of the split block of this name.
    fn is_part_of(&self, name: &str) -> bool {
        let number = self
            .name
            .strip_prefix(name)
            .and_then(|n| n.strip_prefix('.'));
        number.is_some_and(|number| number.parse::<usize>().is_ok())
    }
}

/// A facet of an element: an edge in 2-D, a face in 3-D.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Facet {
    /// Index into [`Mesh::elements`].
    pub element: u32,
    /// Index into [`ElementKind::facets`] of the element's kind.
    pub local: u8,
}

/// A named set, from a physical group of a mesh file or a side of a shape.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// Physical name, or `block.xmin` and the like for shapes.
    pub name: String,
    /// Nodes, sorted, each once.
    pub nodes: Vec<u32>,
    /// Boundary facets, sorted, each once; empty for groups of points.
    pub facets: Vec<Facet>,
    /// Origin, for messages: "surfaces of prisms.msh" and the like.
    pub origin: String,
    /// Elements, facets and edges of the group inside blocks.
    pub(crate) inside: GroupInterior,
}

impl Group {
    /// Returns the part of the group on these nodes and elements, without the interior, which loads
    /// and boundary conditions do not need.
    fn within(&self, nodes: &Range<u32>, elements: &Range<u32>) -> Self {
        let on_nodes = self.nodes.iter().filter(|node| nodes.contains(node));
        let facets = self.facets.iter();
        let on_elements = facets.filter(|facet| elements.contains(&facet.element));
        Self {
            name: self.name.clone(),
            nodes: on_nodes.copied().collect(),
            facets: on_elements.copied().collect(),
            origin: self.origin.clone(),
            inside: GroupInterior::default(),
        }
    }
}

/// Elements, facets and edges of a group that are not boundary facets. New nodes on them belong to
/// the group.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct GroupInterior {
    /// Elements, for groups of full dimension.
    pub(crate) elements: Vec<u32>,
    /// Facets within blocks.
    pub(crate) facets: Vec<Facet>,
    /// End nodes of the edges of curves in 3-D, the lower one first.
    pub(crate) edges: Vec<[u32; 2]>,
}
