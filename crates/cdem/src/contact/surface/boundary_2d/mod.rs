//! Boundaries in 2-D: boundary vertices against boundary edges.

#[cfg(test)]
mod exact_tests;
#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::contact::surface::{Configuration, Pair, Topology};
use crate::math::vector::{add, norm, scale, sub};
use crate::mesh::Mesh;

/// A boundary vertex with its two edges.
#[derive(Clone, Debug)]
pub(crate) struct Vertex {
    pub(crate) node: [u32; 1],
    /// The edge that ends here and the edge that starts here; `None` if there are more than two
    /// edges.
    pub(crate) edges: Option<[u32; 2]>,
}

/// The boundary of all blocks in the plane.
#[derive(Clone, Debug)]
pub(crate) struct Boundary2d {
    pub(crate) vertices: Vec<Vertex>,
    /// Nodes of the edges, with the block to their left.
    pub(crate) edges: Vec<[u32; 2]>,
    /// Vertex number of each end of each edge.
    pub(crate) ends: Vec<[u32; 2]>,
    /// Thickness, m.
    pub(crate) thickness: f64,
}

impl Boundary2d {
    /// Returns the boundary of `mesh`; `thickness` in m.
    pub(crate) fn new(mesh: &Mesh<2>, thickness: f64) -> Self {
        let edges: Vec<[u32; 2]> = mesh
            .boundary_facets()
            .iter()
            .map(|&facet| {
                let mut nodes = mesh.facet_nodes(facet);
                std::array::from_fn(|_| nodes.next().expect("an edge has two nodes"))
            })
            .collect();
        let mut nodes: Vec<u32> = edges.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let vertex_of = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let ends: Vec<[u32; 2]> = edges.iter().map(|edge| edge.map(vertex_of)).collect();
        let mut into = vec![Vec::new(); nodes.len()];
        let mut out = vec![Vec::new(); nodes.len()];
        for (number, [start, end]) in ends.iter().enumerate() {
            out[*start as usize].push(number as u32);
            into[*end as usize].push(number as u32);
        }
        let vertices = nodes
            .iter()
            .zip(into.iter().zip(&out))
            .map(|(&node, (into, out))| Vertex {
                node: [node],
                edges: match (into.as_slice(), out.as_slice()) {
                    (&[before], &[after]) => Some([before, after]),
                    _ => None,
                },
            })
            .collect();
        Self {
            vertices,
            edges,
            ends,
            thickness,
        }
    }

    /// Returns the positions of the ends of an edge, m.
    pub(crate) fn edge(&self, edge: u32, at: Configuration<2>) -> ([f64; 2], [f64; 2]) {
        let [a, b] = self.edges[edge as usize];
        (at.at(a), at.at(b))
    }

    /// Returns the unit direction of an edge, with the block to its left.
    pub(crate) fn direction(&self, edge: u32, at: Configuration<2>) -> [f64; 2] {
        let (a, b) = self.edge(edge, at);
        let along = sub(&b, &a);
        scale(1.0 / norm(&along), &along)
    }

    /// Returns the outward unit normal of an edge.
    pub(crate) fn outward(&self, edge: u32, at: Configuration<2>) -> [f64; 2] {
        let [x, y] = self.direction(edge, at);
        [y, -x]
    }

    /// Returns the sum of the normals of both edges at a vertex.
    pub(crate) fn outward_at(&self, vertex: u32, at: Configuration<2>) -> [f64; 2] {
        let edges = self.vertices[vertex as usize].edges.into_iter().flatten();
        edges.fold([0.0; 2], |sum, edge| add(&sum, &self.outward(edge, at)))
    }

    /// Returns the main node of a pair.
    pub(crate) fn main_node(&self, pair: Pair) -> u32 {
        self.vertices[pair.main as usize].node[0]
    }

    /// Returns the next edge beyond the end of `edge`, or before its start.
    pub(crate) fn next(&self, edge: u32, beyond_end: bool) -> Option<u32> {
        let end = self.ends[edge as usize][usize::from(beyond_end)];
        let [before, after] = self.vertices[end as usize].edges?;
        Some(if beyond_end { after } else { before })
    }
}

impl Topology<2> for Boundary2d {
    fn main_nodes(&self, main: u32) -> &[u32] {
        &self.vertices[main as usize].node
    }

    fn target_nodes(&self, target: u32) -> &[u32] {
        &self.edges[target as usize]
    }

    fn families(&self) -> Vec<[Range<u32>; 2]> {
        vec![[0..self.vertices.len() as u32, 0..self.edges.len() as u32]]
    }
}
