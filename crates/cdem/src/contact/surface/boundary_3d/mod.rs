//! Surfaces in 3-D: boundary vertices against triangles, and sharp edges
//! against sharp edges.
//!
//! Every contact of polyhedra is a union of these two ([`facing`],
//! [`crossing`]). Main features are the vertices, then the edges; target
//! features the triangles, then the edges.

#[cfg(test)]
mod exact_tests;
#[cfg(test)]
mod sharp_tests;
#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::contact::surface::aabb::Aabb;
use crate::contact::surface::geometry_cache::GeometryCache;
use crate::contact::surface::triangulation::Triangulation;
use crate::contact::surface::{Configuration, Pair, Topology};
use crate::mesh::Mesh;

/// The boundary of all blocks in space.
#[derive(Clone, Debug)]
pub(crate) struct Boundary3d {
    pub(crate) skin: Triangulation,
}

/// The two features of a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FeaturePair {
    /// A vertex before a triangle.
    Facing { vertex: u32, triangle: u32 },
    /// Two edges.
    Crossing { main: u32, target: u32 },
}

/// Triangles for each pair looked at, or contact held, at most, for which room pays.
const PAIRS: usize = 3;

impl Boundary3d {
    /// The boundary of `mesh`, for contact within `tolerance`, m.
    pub(crate) fn new(mesh: &Mesh<3>, tolerance: f64) -> Self {
        Self {
            skin: Triangulation::new(mesh, tolerance),
        }
    }

    pub(crate) fn meeting(&self, pair: Pair) -> FeaturePair {
        let triangles = self.skin.triangles.len() as u32;
        if pair.main < self.skin.vertex_count {
            FeaturePair::Facing {
                vertex: pair.main,
                triangle: pair.target,
            }
        } else {
            FeaturePair::Crossing {
                main: pair.main - self.skin.vertex_count,
                target: pair.target - triangles,
            }
        }
    }

    /// The pair of a vertex and a triangle.
    pub(crate) fn face_pair(vertex: u32, triangle: u32) -> Pair {
        Pair {
            main: vertex,
            target: triangle,
        }
    }

    /// The pair of two edges.
    pub(crate) fn edge_pair(&self, one: u32, other: u32) -> Pair {
        Pair {
            main: self.skin.vertex_count + one.min(other),
            target: self.skin.triangles.len() as u32 + one.max(other),
        }
    }

    /// Box around an edge, grown by `margin`; empty where it cannot cross others yet.
    fn box_of_edge(&self, edge: u32, at: Configuration<3>, margin: f64) -> Aabb<3> {
        if self.skin.may_be_sharp(edge, at, margin) {
            Aabb::around(self.skin.edge(edge, at), margin)
        } else {
            Aabb::around([], 0.0)
        }
    }
}

impl Topology<3> for Boundary3d {
    fn main_nodes(&self, main: u32) -> &[u32] {
        match main.checked_sub(self.skin.vertex_count) {
            None => self.skin.nodes_of_corner(main),
            Some(edge) => self.skin.nodes_of_edge(edge),
        }
    }

    fn target_nodes(&self, target: u32) -> &[u32] {
        match target.checked_sub(self.skin.triangles.len() as u32) {
            None => self.skin.nodes_of_triangle(target),
            Some(edge) => self.skin.nodes_of_edge(edge),
        }
    }

    fn form(&self, pairs: usize, old: Option<GeometryCache<3>>) -> Option<GeometryCache<3>> {
        match old {
            Some(mut old) => {
                old.clear();
                Some(old)
            }
            None => (pairs > self.skin.triangles.len() / PAIRS).then(|| self.skin.form()),
        }
    }

    fn families(&self) -> Vec<[Range<u32>; 2]> {
        let (vertices, edges) = (self.skin.vertex_count, self.skin.edges.len() as u32);
        let triangles = self.skin.triangles.len() as u32;
        vec![
            [0..vertices, 0..triangles],
            [vertices..vertices + edges, triangles..triangles + edges],
        ]
    }

    fn main_box(&self, main: u32, at: Configuration<3>, margin: f64) -> Aabb<3> {
        match main.checked_sub(self.skin.vertex_count) {
            None => Aabb::around([self.skin.point(main, at)], margin),
            Some(edge) => self.box_of_edge(edge, at, margin),
        }
    }

    fn target_box(&self, target: u32, at: Configuration<3>, margin: f64) -> Aabb<3> {
        match target.checked_sub(self.skin.triangles.len() as u32) {
            None => Aabb::around(self.skin.triangle(target, at), margin),
            Some(edge) => self.box_of_edge(edge, at, margin),
        }
    }

    fn matches(&self, pair: Pair) -> bool {
        match self.meeting(pair) {
            FeaturePair::Facing { .. } => true,
            FeaturePair::Crossing { main, target } => main < target,
        }
    }
}
