//! Single elements, each cut into any number of smaller ones, for meshes of any fineness.

use std::collections::BTreeMap;

use cdem::mesh::{CellKind, ElementKind, RawGroup, RawMesh};

/// A body with the shape of one element, cut into `pieces` elements of the same kind along each
/// edge.
#[derive(Clone, Debug)]
pub struct Body {
    /// Shape of the body and of its elements.
    pub kind: ElementKind,
    /// Corners in Gmsh's order, m.
    pub corners: Vec<[f64; 3]>,
    /// Number of elements along an edge.
    pub pieces: usize,
}

/// Builds a mesh of bodies that share no nodes, each in a physical group of its name.
#[must_use]
pub fn mesh_of(bodies: &[(&str, Body)]) -> RawMesh {
    let mut mesh = RawMesh {
        origin: "bodies".to_owned(),
        group_sets: vec![Vec::new()],
        ..RawMesh::default()
    };
    for (number, (name, body)) in (0_u32..).zip(bodies) {
        mesh.groups.push(RawGroup {
            dimension: 3,
            tag: number as i32 + 1,
            name: (*name).to_owned(),
        });
        mesh.group_sets.push(vec![number]);
        body.add_to(&mut mesh, number + 1);
    }
    mesh.point_tags = (1..=mesh.points.len() as u64).collect();
    mesh
}

/// Builds a mesh of bodies that share no nodes, in no physical group.
#[must_use]
pub fn stones_of(bodies: impl IntoIterator<Item = Body>) -> RawMesh {
    let mut mesh = RawMesh {
        origin: "stones".to_owned(),
        group_sets: vec![Vec::new()],
        ..RawMesh::default()
    };
    for body in bodies {
        body.add_to(&mut mesh, 0);
    }
    mesh.point_tags = (1..=mesh.points.len() as u64).collect();
    mesh
}

impl Body {
    fn add_to(&self, mesh: &mut RawMesh, set: u32) {
        let mut numbers = BTreeMap::new();
        for cell in cells(self.kind, self.pieces) {
            let mut nodes = Vec::with_capacity(cell.len());
            for place in cell {
                let node = *numbers.entry(place).or_insert_with(|| {
                    mesh.points.push(self.point(place));
                    mesh.points.len() as u32 - 1
                });
                nodes.push(node);
            }
            let cells = mesh.cells_mut(CellKind::Element(self.kind));
            cells.nodes.extend(nodes);
            cells.tags.push(cells.tags.len() as u64 + 1);
            cells.sets.push(set);
        }
    }

    /// Returns the position of a lattice point, by the shape functions of the body.
    fn point(&self, place: [usize; 3]) -> [f64; 3] {
        let [x, y, z] = place.map(|k| k as f64 / self.pieces as f64);
        let weights = match self.kind {
            ElementKind::Tet4 => vec![1.0 - x, x - y, y - z, z],
            ElementKind::Wedge6 => [1.0 - z, z]
                .iter()
                .flat_map(|end| [1.0 - x, x - y, y].map(|weight| end * weight))
                .collect(),
            _ => [1.0 - z, z]
                .iter()
                .flat_map(|end| {
                    let around = [(1.0 - x, 1.0 - y), (x, 1.0 - y), (x, y), (1.0 - x, y)];
                    around.map(|(along, across)| end * along * across)
                })
                .collect(),
        };
        let corners = self.corners.iter().zip(&weights);
        corners.fold([0.0; 3], |sum, (corner, weight)| {
            [0, 1, 2].map(|c| sum[c] + weight * corner[c])
        })
    }
}

/// Returns the cells of a body by the lattice indices of their nodes. Tetrahedra fill x ≥ y ≥ z and
/// wedges x ≥ y (Kuhn's division of a cube).
fn cells(kind: ElementKind, pieces: usize) -> Vec<Vec<[usize; 3]>> {
    let templates: &[&[[usize; 3]]] = match kind {
        ElementKind::Tet4 => &[
            &[[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
            &[[0, 0, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]],
            &[[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]],
            &[[0, 0, 0], [1, 0, 1], [1, 0, 0], [1, 1, 1]],
            &[[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 1]],
            &[[0, 0, 0], [0, 1, 1], [0, 0, 1], [1, 1, 1]],
        ],
        ElementKind::Wedge6 => &[
            &[
                [0, 0, 0],
                [1, 0, 0],
                [1, 1, 0],
                [0, 0, 1],
                [1, 0, 1],
                [1, 1, 1],
            ],
            &[
                [0, 0, 0],
                [1, 1, 0],
                [0, 1, 0],
                [0, 0, 1],
                [1, 1, 1],
                [0, 1, 1],
            ],
        ],
        _ => &[&[
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [0, 1, 1],
        ]],
    };
    let belongs = |[x, y, z]: &[usize; 3]| match kind {
        ElementKind::Tet4 => x >= y && y >= z,
        ElementKind::Wedge6 => x >= y,
        _ => true,
    };
    let mut cells = Vec::new();
    for number in 0..pieces.pow(3) {
        let first = [
            number % pieces,
            number / pieces % pieces,
            number / pieces.pow(2),
        ];
        for template in templates {
            let cell = template
                .iter()
                .map(|node| [0, 1, 2].map(|c| first[c] + node[c]));
            let cell: Vec<[usize; 3]> = cell.collect();
            if cell.iter().all(belongs) {
                cells.push(cell);
            }
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tetrahedra;

    #[test]
    fn pieces_fill_the_whole() {
        let cube = &cells(ElementKind::Hex8, 1)[0];
        let cases: [(ElementKind, &[usize], f64); 3] = [
            (ElementKind::Tet4, &[0, 1, 3, 4], 1.0 / 6.0),
            (ElementKind::Wedge6, &[0, 1, 3, 4, 5, 7], 0.5),
            (ElementKind::Hex8, &[0, 1, 2, 3, 4, 5, 6, 7], 1.0),
        ];
        for (kind, corners, whole) in cases {
            for pieces in [1, 2, 3] {
                let corners = corners.iter().map(|&k| cube[k].map(|x| x as f64)).collect();
                let mesh = mesh_of(&[(
                    "body",
                    Body {
                        kind,
                        corners,
                        pieces,
                    },
                )]);
                let cells = mesh.cells[0].nodes.chunks(kind.node_count());
                assert_eq!(cells.len(), pieces.pow(3));
                let mut volume = 0.0;
                for cell in cells {
                    for tetrahedron in tetrahedra(kind) {
                        let [o, a, b, c] = tetrahedron.map(|k| mesh.points[cell[k] as usize]);
                        let [a, b, c] = [a, b, c].map(|p| [0, 1, 2].map(|c| p[c] - o[c]));
                        let product = (0..3).map(|k| {
                            let [i, j] = [(k + 1) % 3, (k + 2) % 3];
                            a[k] * (b[i] * c[j] - b[j] * c[i])
                        });
                        volume += product.sum::<f64>().abs() / 6.0;
                    }
                }
                // Every volume counts as positive, so an overlap would make the sum too large.
                assert!((volume / whole - 1.0).abs() < 1e-12, "{kind:?} {volume}");
            }
        }
    }
}
