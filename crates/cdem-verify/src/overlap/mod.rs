//! Overlap of blocks, by brute force and independent of contact detection.

mod solid;

use cdem::output::{FieldValues, Frame};

/// Returns the deepest overlap of blocks, m; 0 if there is none. In 2-D: the largest depth of a
/// node of one block inside another block. In 3-D: the largest shift that separates two cells of
/// different blocks.
///
/// # Panics
/// If the frame has no field `block`.
#[must_use]
pub fn deepest_overlap(frame: &Frame) -> f64 {
    let cells = cells(frame);
    if frame.kinds.iter().any(|kind| kind.dimension() == 3) {
        return solid::deepest(frame, &cells);
    }
    let boundary = boundary(&cells);
    let mut deepest = 0.0_f64;
    for (point, at) in frame.points.iter().enumerate() {
        let point = point as u32;
        let owner = cells.iter().find(|(_, nodes)| nodes.contains(&point));
        let Some(&(own, _)) = owner else { continue };
        let inside = |(_, nodes): &&(i32, Vec<u32>)| contains(frame, nodes, at);
        for (block, _) in cells.iter().filter(|cell| cell.0 != own).filter(inside) {
            let edges = boundary.iter().filter(|edge| edge.0 == *block);
            let depth = edges.map(|(_, [a, b])| {
                distance(at, &frame.points[*a as usize], &frame.points[*b as usize])
            });
            deepest = deepest.max(depth.fold(f64::INFINITY, f64::min));
        }
    }
    deepest
}

/// Returns the block and the nodes of each cell.
fn cells(frame: &Frame) -> Vec<(i32, Vec<u32>)> {
    let field = frame.cell_fields.iter().find(|field| field.name == "block");
    let Some(FieldValues::Whole(blocks)) = field.map(|field| &field.values) else {
        panic!("a frame names the block of each cell");
    };
    let mut rest = frame.connectivity.as_slice();
    let kinds = frame.kinds.iter().zip(blocks);
    kinds
        .map(|(kind, &block)| {
            let (nodes, after) = rest.split_at(kind.node_count());
            rest = after;
            (block, nodes.to_vec())
        })
        .collect()
}

/// Returns the edges that belong to one cell only, with their block.
fn boundary(cells: &[(i32, Vec<u32>)]) -> Vec<(i32, [u32; 2])> {
    let mut edges = Vec::new();
    for (block, nodes) in cells {
        for (k, &a) in nodes.iter().enumerate() {
            edges.push((*block, [a, nodes[(k + 1) % nodes.len()]]));
        }
    }
    edges.sort_unstable();
    let single =
        |(block, [a, b]): &(i32, [u32; 2])| edges.binary_search(&(*block, [*b, *a])).is_err();
    edges.iter().copied().filter(|edge| single(edge)).collect()
}

fn contains(frame: &Frame, nodes: &[u32], at: &[f64; 3]) -> bool {
    (0..nodes.len()).all(|k| {
        let [a, b] = [k, (k + 1) % nodes.len()].map(|i| frame.points[nodes[i] as usize]);
        (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]) > 0.0
    })
}

/// Returns the distance of a point from a segment, m.
fn distance(at: &[f64; 3], a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [at[0] - a[0], at[1] - a[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    let foot = ((from[0] * along[0] + from[1] * along[1]) / length).clamp(0.0, 1.0);
    f64::hypot(from[0] - foot * along[0], from[1] - foot * along[1])
}
