//! Refinement of tetrahedral meshes: edges half as long.

use std::collections::{BTreeMap, BTreeSet};

use cdem::mesh::{CellKind, ElementKind, RawMesh};

const TETRAHEDRON: CellKind = CellKind::Element(ElementKind::Tet4);
const TRIANGLE: CellKind = CellKind::Element(ElementKind::Tri3);

/// Splits every tetrahedron into eight and every triangle into four. New nodes on boundary faces
/// that are in no physical group are moved by `place`.
pub(crate) fn halve(mut mesh: RawMesh, place: impl Fn([f64; 3]) -> [f64; 3]) -> RawMesh {
    let curved = curved_edges(&mut mesh);
    let mut middles = Middles {
        of: BTreeMap::new(),
        curved: &curved,
        place: &place,
    };
    for kind in [TRIANGLE, TETRAHEDRON] {
        let cells = mesh.cells_mut(kind).clone();
        let mut nodes = Vec::new();
        for cell in cells.nodes.chunks_exact(kind.node_count()) {
            match *cell {
                [a, b, c] => nodes.extend(quarters([a, b, c], &mut mesh, &mut middles)),
                [a, b, c, d] => nodes.extend(eighths([a, b, c, d], &mut mesh, &mut middles)),
                _ => unreachable!("triangles and tetrahedra only"),
            }
        }
        let count = if kind == TRIANGLE { 4 } else { 8 };
        let fine = mesh.cells_mut(kind);
        fine.nodes = nodes;
        fine.tags = (1..=(cells.tags.len() * count) as u64).collect();
        fine.sets = cells
            .sets
            .iter()
            .flat_map(|&set| std::iter::repeat_n(set, count))
            .collect();
    }
    mesh.point_tags = (1..=mesh.points.len() as u64).collect();
    mesh
}

fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the edges of boundary faces (faces of one tetrahedron only) that no triangle of a group
/// covers.
fn curved_edges(mesh: &mut RawMesh) -> BTreeSet<[u32; 2]> {
    let sorted = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let flat = mesh.cells_mut(TRIANGLE).nodes.clone();
    let mut count: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    for face in flat.chunks_exact(3) {
        *count
            .entry(sorted([face[0], face[1], face[2]]))
            .or_default() += 1;
    }
    for cell in mesh.cells_mut(TETRAHEDRON).nodes.chunks_exact(4) {
        for left_out in 0..4 {
            let face = std::array::from_fn(|k| cell[(left_out + 1 + k) % 4]);
            *count.entry(sorted(face)).or_default() += 1;
        }
    }
    let alone = count.into_iter().filter(|&(_, count)| count == 1);
    alone
        .flat_map(|([a, b, c], _)| [edge(a, b), edge(b, c), edge(a, c)])
        .collect()
}

struct Middles<'a> {
    of: BTreeMap<[u32; 2], u32>,
    curved: &'a BTreeSet<[u32; 2]>,
    place: &'a dyn Fn([f64; 3]) -> [f64; 3],
}

impl Middles<'_> {
    fn between(&mut self, a: u32, b: u32, mesh: &mut RawMesh) -> u32 {
        let edge = edge(a, b);
        *self.of.entry(edge).or_insert_with(|| {
            let [a, b] = edge.map(|node| mesh.points[node as usize]);
            let middle = std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
            let curved = self.curved.contains(&edge);
            mesh.points
                .push(if curved { (self.place)(middle) } else { middle });
            mesh.points.len() as u32 - 1
        })
    }
}

fn quarters([a, b, c]: [u32; 3], mesh: &mut RawMesh, middles: &mut Middles) -> [u32; 12] {
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| middles.between(p, q, mesh));
    [a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]
}

/// Four corner tetrahedra, and four of the octahedron between them around its shortest diagonal.
fn eighths([a, b, c, d]: [u32; 4], mesh: &mut RawMesh, middles: &mut Middles) -> Vec<u32> {
    let mut between = |p, q| middles.between(p, q, mesh);
    let [ab, ac, ad] = [b, c, d].map(|q| between(a, q));
    let [bc, bd, cd] = [between(b, c), between(b, d), between(c, d)];
    let mut nodes = vec![a, ab, ac, ad, ab, b, bc, bd, ac, bc, c, cd, ad, bd, cd, d];
    // Each diagonal of the octahedron, and the ring of the other four corners.
    let octahedron = [
        ([ab, cd], [ac, ad, bd, bc]),
        ([ac, bd], [ab, bc, cd, ad]),
        ([ad, bc], [ab, ac, cd, bd]),
    ];
    let length = |[p, q]: [u32; 2]| {
        let [p, q] = [p, q].map(|node| mesh.points[node as usize]);
        (0..3).map(|c| (p[c] - q[c]).powi(2)).sum::<f64>()
    };
    let shortest = octahedron
        .into_iter()
        .min_by(|one, other| length(one.0).total_cmp(&length(other.0)));
    if let Some(([p, q], ring)) = shortest {
        for k in 0..4 {
            nodes.extend([p, q, ring[k], ring[(k + 1) % 4]]);
        }
    }
    nodes
}
