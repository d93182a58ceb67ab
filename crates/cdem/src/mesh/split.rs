//! Splits a mesh into parts that become blocks.

use std::ops::Range;

use crate::math::disjoint_sets::DisjointSets;
use crate::mesh::assemble::SourceCell;
use crate::mesh::{Element, Mesh};
use crate::scene::Split;

/// Sorts `cells` by part and returns the range of each part. Parts are in the order of their first
/// cells.
pub(super) fn parts(
    split: Split,
    cells: &mut [SourceCell],
    node_count: usize,
) -> Vec<Range<usize>> {
    match split {
        Split::None => std::iter::once(0..cells.len()).collect(),
        Split::Cells => (0..cells.len()).map(|i| i..i + 1).collect(),
        Split::Components => components(cells, node_count),
    }
}

impl<const D: usize> Mesh<D> {
    /// Returns the number of parts of a block that share no nodes with each other.
    pub(crate) fn part_count(&self, block: usize) -> usize {
        let block = &self.blocks[block];
        let elements = block.elements.start as usize..block.elements.end as usize;
        let count = block.nodes.len();
        let mut joined = DisjointSets::new(count);
        for element in &self.elements[elements] {
            join_nodes(&mut joined, element, block.nodes.start);
        }
        joined.flatten();
        (0..count as u32)
            .filter(|&node| joined.root(node) == node)
            .count()
    }
}

/// Returns the parts connected through shared nodes.
fn components(cells: &mut [SourceCell], node_count: usize) -> Vec<Range<usize>> {
    let mut joined = DisjointSets::new(node_count);
    for cell in &*cells {
        join_nodes(&mut joined, &cell.element, 0);
    }
    joined.flatten();
    // The number of a component is that of its first cell.
    let mut first = vec![u32::MAX; node_count];
    let mut keyed: Vec<(u32, SourceCell)> = Vec::with_capacity(cells.len());
    for (number, &cell) in (0..).zip(&*cells) {
        let root = joined.root(cell.element.nodes[0]) as usize;
        first[root] = first[root].min(number);
        keyed.push((first[root], cell));
    }
    keyed.sort_by_key(|&(component, _)| component);
    let mut ranges = Vec::new();
    let mut start = 0;
    for chunk in keyed.chunk_by(|a, b| a.0 == b.0) {
        ranges.push(start..start + chunk.len());
        start += chunk.len();
    }
    cells
        .iter_mut()
        .zip(keyed)
        .for_each(|(slot, (_, cell))| *slot = cell);
    ranges
}

/// Joins the nodes of an element; node numbers count from `first`.
fn join_nodes(sets: &mut DisjointSets, element: &Element, first: u32) {
    for pair in element.nodes().windows(2) {
        sets.join(pair[0] - first, pair[1] - first);
    }
}
