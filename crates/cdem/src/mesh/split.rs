//! Splits a mesh into parts that become blocks.

use std::ops::Range;

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
            joined.join_all(element, block.nodes.start);
        }
        (0..count as u32)
            .filter(|&node| joined.root(node) == node)
            .count()
    }
}

/// Returns the parts connected through shared nodes.
fn components(cells: &mut [SourceCell], node_count: usize) -> Vec<Range<usize>> {
    let mut joined = DisjointSets::new(node_count);
    for cell in &*cells {
        joined.join_all(&cell.element, 0);
    }
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

/// A disjoint-set forest with path halving; the smaller number is the root.
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(node_count: usize) -> Self {
        Self((0..node_count as u32).collect())
    }

    /// Joins the nodes of an element; node numbers count from `first`.
    fn join_all(&mut self, element: &Element, first: u32) {
        for pair in element.nodes().windows(2) {
            self.join(pair[0] - first, pair[1] - first);
        }
    }

    fn root(&mut self, mut node: u32) -> u32 {
        while self.0[node as usize] != node {
            let parent = self.0[node as usize];
            self.0[node as usize] = self.0[parent as usize];
            node = parent;
        }
        node
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
