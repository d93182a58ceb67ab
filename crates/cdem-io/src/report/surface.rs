//! Visible surface of a frame: all cells in 2-D, outer faces in 3-D.

use std::collections::HashMap;

use cdem::mesh::ElementKind;

use crate::results::SavedFrame;

/// Triangles and edges of the visible surface, with their own numbers of points.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Surface {
    /// Points of the frame that the surface uses.
    pub(super) points: Vec<u32>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) edges: Vec<[u32; 2]>,
    /// Cell of each triangle.
    pub(super) cells: Vec<u32>,
}

impl Surface {
    /// Returns the surface of a frame. In 3-D each triangle is counter-clockwise seen from outside.
    pub(super) fn of(frame: &SavedFrame) -> Self {
        let mut making = Making {
            surface: Self::default(),
            known: vec![u32::MAX; frame.points.len()],
        };
        let mut edges = Vec::new();
        for (cell, facet) in visible(frame) {
            let own: Vec<u32> = facet.iter().map(|&point| making.number(point)).collect();
            for k in 1..own.len() - 1 {
                making.surface.triangles.push([own[0], own[k], own[k + 1]]);
                making.surface.cells.push(cell);
            }
            let next = own.iter().cycle().skip(1);
            let around = own.iter().zip(next);
            edges.extend(around.map(|(&a, &b)| [a.min(b), a.max(b)]));
        }
        edges.sort_unstable();
        edges.dedup();
        making.surface.edges = edges;
        making.surface
    }
}

/// A surface under construction.
struct Making {
    surface: Surface,
    /// Number of each point of the frame in the surface.
    known: Vec<u32>,
}

impl Making {
    fn number(&mut self, point: u32) -> u32 {
        let known = &mut self.known[point as usize];
        if *known == u32::MAX {
            *known = self.surface.points.len() as u32;
            self.surface.points.push(point);
        }
        *known
    }
}

/// Returns the visible polygons with their cells: in 2-D the cells themselves, in 3-D the faces
/// that belong to one cell only.
fn visible(frame: &SavedFrame) -> Vec<(u32, Vec<u32>)> {
    let mut faces = Vec::new();
    let mut of_face: HashMap<Vec<u32>, u32> = HashMap::new();
    let mut start = 0;
    for (cell, &kind) in (0..).zip(&frame.kinds) {
        let nodes = &frame.connectivity[start..start + kind.node_count()];
        start += kind.node_count();
        for facet in polygons(kind) {
            let facet: Vec<u32> = facet.iter().map(|&i| nodes[i as usize]).collect();
            let mut key = facet.clone();
            key.sort_unstable();
            *of_face.entry(key).or_default() += 1;
            faces.push((cell, facet));
        }
    }
    faces.retain(|(_, facet)| {
        let mut key = facet.clone();
        key.sort_unstable();
        of_face.get(&key) == Some(&1)
    });
    faces
}

fn polygons(kind: ElementKind) -> &'static [&'static [u8]] {
    match kind {
        ElementKind::Tri3 => &[&[0, 1, 2]],
        ElementKind::Quad4 => &[&[0, 1, 2, 3]],
        _ => kind.facets(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(kinds: &[ElementKind], connectivity: &[u32], points: usize) -> SavedFrame {
        SavedFrame {
            points: vec![[0.0; 3]; points],
            kinds: kinds.to_vec(),
            connectivity: connectivity.to_vec(),
            ..SavedFrame::default()
        }
    }

    #[test]
    fn in_the_plane_all_elements_are_seen() {
        use ElementKind::{Quad4, Tri3};
        let surface = Surface::of(&frame(&[Quad4, Tri3], &[0, 1, 2, 3, 1, 4, 2], 5));
        assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
        assert_eq!(surface.cells, [0, 0, 1]);
        assert_eq!(surface.edges.len(), 6);
    }

    #[test]
    fn in_space_faces_between_elements_are_not_seen() {
        let nodes = [0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 6, 7, 8, 9, 10, 11];
        let surface = Surface::of(&frame(&[ElementKind::Hex8; 2], &nodes, 13));
        assert_eq!(surface.triangles.len(), 2 * 10);
        assert_eq!(surface.points.len(), 12, "the last point is of no cell");
        // Euler's formula; each face is a quadrilateral of two triangles.
        let faces = surface.triangles.len() / 2;
        assert_eq!(surface.points.len() + faces, surface.edges.len() + 2);
    }
}
