//! The mesh before refinement.

use crate::math::adjacency::Adjacency;
use crate::mesh::{Element, Mesh};

/// A mesh, with the elements around its nodes.
#[derive(Clone, Copy)]
pub(crate) struct BaseMesh<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    around: &'a Adjacency,
}

impl<'a, const D: usize> BaseMesh<'a, D> {
    pub(crate) fn new(mesh: &'a Mesh<D>, around: &'a Adjacency) -> Self {
        Self { mesh, around }
    }

    /// Returns the number of nodes.
    pub(super) fn node_count(&self) -> u32 {
        self.mesh.nodes.len() as u32
    }

    /// Returns the rest position of a node, m.
    pub(super) fn point(&self, node: u32) -> [f64; D] {
        self.mesh.nodes[node as usize]
    }

    pub(super) fn element(&self, number: u32) -> &'a Element {
        &self.mesh.elements[number as usize]
    }

    /// Returns the elements that have an edge.
    pub(super) fn at_edge(&self, [a, b]: [u32; 2]) -> impl Iterator<Item = u32> {
        let around = self.around.of(a).iter().copied();
        around.filter(move |&number| {
            let element = self.element(number);
            element.kind.facets().iter().any(|facet| {
                let next = facet.iter().cycle().skip(1);
                let mut edges = facet.iter().zip(next).take(facet.len());
                edges.any(|(&i, &j)| {
                    let ends = [i, j].map(|k| element.nodes[k as usize]);
                    ends == [a, b] || ends == [b, a]
                })
            })
        })
    }

    /// Returns the element on the other side of a facet; `facet` is the local number of the facet.
    pub(super) fn across(&self, number: u32, facet: usize) -> Option<u32> {
        let element = self.element(number);
        let facet = element.kind.facets()[facet].iter();
        let nodes: Vec<u32> = facet.map(|&i| element.nodes[i as usize]).collect();
        let mut beside = self.around.of(nodes[0]).iter().copied();
        beside.find(|&other| {
            let has = |node: &u32| self.element(other).nodes().contains(node);
            other != number && nodes.iter().all(has)
        })
    }
}
