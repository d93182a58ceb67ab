//! Adjacency lists: the items at each node, from the nodes of each item.

/// Lists of the items at each node, both by index.
#[derive(Clone, Debug, Default)]
pub(crate) struct Adjacency {
    start: Vec<u32>,
    items: Vec<u32>,
}

impl Adjacency {
    /// Builds the lists for `count` nodes; `nodes_of` gives the nodes of one item after the other.
    pub(crate) fn new<'a>(nodes_of: impl Iterator<Item = &'a [u32]> + Clone, count: usize) -> Self {
        let mut start = vec![0_u32; count + 1];
        for &node in nodes_of.clone().flatten() {
            start[node as usize + 1] += 1;
        }
        for node in 0..count {
            start[node + 1] += start[node];
        }
        let mut next = start.clone();
        let mut items = vec![0; start[count] as usize];
        for (number, nodes) in nodes_of.enumerate() {
            for &node in nodes {
                items[next[node as usize] as usize] = number as u32;
                next[node as usize] += 1;
            }
        }
        Self { start, items }
    }

    /// Returns the items at a node.
    pub(crate) fn of(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.items[self.start[node] as usize..self.start[node + 1] as usize]
    }
}
