//! Boundaries in 3-D: boundary vertices against triangles, and sharp edges against sharp edges.
//!
//! Every contact of polyhedra is a union of these two (point–triangle, edge–edge). Main features
//! are the vertices, then the edges; target features are the triangles, then the edges.

#[cfg(test)]
mod area_tests;
#[cfg(test)]
mod exact_tests;
#[cfg(test)]
mod sharp_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod touch_tests;

use std::ops::Range;

use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::geometry_cache::GeometryCache;
use crate::contact::surface::triangulation::Triangulation;
use crate::contact::surface::{Configuration, Pair, Topology};
use crate::contact::tolerances::CACHE_WORTH_PAIRS;
use crate::mesh::Mesh;

/// The boundary of all blocks in space.
#[derive(Clone, Debug)]
pub(crate) struct Boundary3d {
    pub(crate) triangulation: Triangulation,
}

/// The two features of a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FeaturePair {
    /// A vertex against a triangle.
    PointTriangle { vertex: u32, triangle: u32 },
    /// Two edges.
    EdgeEdge { main: u32, target: u32 },
}

impl Boundary3d {
    /// Returns the boundary of `mesh`, for contact within `resolution`, m.
    pub(crate) fn new(mesh: &Mesh<3>, resolution: f64) -> Self {
        Self {
            triangulation: Triangulation::new(mesh, resolution),
        }
    }

    /// Returns the two features of a pair.
    pub(crate) fn feature_pair(&self, pair: Pair) -> FeaturePair {
        let triangles = self.triangulation.triangles.len() as u32;
        if pair.main < self.triangulation.vertex_count {
            FeaturePair::PointTriangle {
                vertex: pair.main,
                triangle: pair.target,
            }
        } else {
            FeaturePair::EdgeEdge {
                main: pair.main - self.triangulation.vertex_count,
                target: pair.target - triangles,
            }
        }
    }

    /// Returns the pair of a vertex and a triangle.
    pub(crate) fn face_pair(vertex: u32, triangle: u32) -> Pair {
        Pair {
            main: vertex,
            target: triangle,
        }
    }

    /// Returns the pair of two edges.
    pub(crate) fn edge_pair(&self, one: u32, other: u32) -> Pair {
        Pair {
            main: self.triangulation.vertex_count + one.min(other),
            target: self.triangulation.triangles.len() as u32 + one.max(other),
        }
    }

    /// Returns the box around an edge, grown by `margin`, m. The box is empty if the edge cannot
    /// cross others yet.
    fn box_of_edge(&self, edge: u32, at: Configuration<3>, margin: f64) -> Aabb<3> {
        if self.triangulation.may_be_sharp(edge, at, margin) {
            Aabb::around(self.triangulation.edge(edge, at), margin)
        } else {
            Aabb::around([], 0.0)
        }
    }
}

impl Topology<3> for Boundary3d {
    fn main_nodes(&self, main: u32) -> &[u32] {
        match main.checked_sub(self.triangulation.vertex_count) {
            None => self.triangulation.nodes_of_corner(main),
            Some(edge) => self.triangulation.nodes_of_edge(edge),
        }
    }

    fn target_nodes(&self, target: u32) -> &[u32] {
        match target.checked_sub(self.triangulation.triangles.len() as u32) {
            None => self.triangulation.nodes_of_triangle(target),
            Some(edge) => self.triangulation.nodes_of_edge(edge),
        }
    }

    fn geometry_cache(
        &self,
        pairs: usize,
        old: Option<GeometryCache<3>>,
    ) -> Option<GeometryCache<3>> {
        match old {
            Some(mut old) => {
                old.clear();
                Some(old)
            }
            None => (pairs > self.triangulation.triangles.len() / CACHE_WORTH_PAIRS)
                .then(|| self.triangulation.geometry_cache()),
        }
    }

    fn families(&self) -> Vec<[Range<u32>; 2]> {
        let (vertices, edges) = (
            self.triangulation.vertex_count,
            self.triangulation.edges.len() as u32,
        );
        let triangles = self.triangulation.triangles.len() as u32;
        vec![
            [0..vertices, 0..triangles],
            [vertices..vertices + edges, triangles..triangles + edges],
        ]
    }

    fn main_box(&self, main: u32, at: Configuration<3>, margin: f64) -> Aabb<3> {
        match main.checked_sub(self.triangulation.vertex_count) {
            None => Aabb::around([self.triangulation.point(main, at)], margin),
            Some(edge) => self.box_of_edge(edge, at, margin),
        }
    }

    fn target_box(&self, target: u32, at: Configuration<3>, margin: f64) -> Aabb<3> {
        match target.checked_sub(self.triangulation.triangles.len() as u32) {
            None => Aabb::around(self.triangulation.triangle(target, at), margin),
            Some(edge) => self.box_of_edge(edge, at, margin),
        }
    }

    fn is_canonical(&self, pair: Pair) -> bool {
        match self.feature_pair(pair) {
            FeaturePair::PointTriangle { .. } => true,
            FeaturePair::EdgeEdge { main, target } => main < target,
        }
    }
}
