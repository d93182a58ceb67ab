//! Adjacency lists: the items at each node.

/// Lists of the items at each node, both by index. Items are numbers, or have data of their own.
#[derive(Clone, Debug, Default)]
pub(crate) struct Adjacency<T = u32> {
    start: Vec<u32>,
    items: Vec<T>,
}

impl Adjacency {
    /// Builds the lists for `count` nodes; `nodes_of` gives the nodes of one item after the other.
    pub(crate) fn new<'a>(nodes_of: impl Iterator<Item = &'a [u32]> + Clone, count: usize) -> Self {
        let items = nodes_of.zip(0..);
        let of_nodes = items.flat_map(|(nodes, number)| nodes.iter().map(move |&n| (n, number)));
        Self::of_pairs(of_nodes, count)
    }
}

impl<T: Clone + Default> Adjacency<T> {
    /// Builds the lists for `count` nodes from pairs of a node and an item. The items of a node
    /// keep their order.
    pub(crate) fn of_pairs(pairs: impl Iterator<Item = (u32, T)> + Clone, count: usize) -> Self {
        let mut start = vec![0_u32; count + 1];
        pairs
            .clone()
            .for_each(|(node, _)| start[node as usize + 1] += 1);
        for node in 0..count {
            start[node + 1] += start[node];
        }
        let mut next = start.clone();
        let mut items = vec![T::default(); start[count] as usize];
        pairs.for_each(|(node, item)| {
            items[next[node as usize] as usize] = item;
            next[node as usize] += 1;
        });
        Self { start, items }
    }

    /// Returns the items at a node.
    pub(crate) fn of(&self, node: u32) -> &[T] {
        let node = node as usize;
        &self.items[self.start[node] as usize..self.start[node + 1] as usize]
    }

    /// Returns the items at each node from `first` on.
    pub(crate) fn lists_from(&self, first: usize) -> impl Iterator<Item = &[T]> {
        let starts = self.start[first..].iter().zip(&self.start[first + 1..]);
        starts.map(|(&start, &end)| &self.items[start as usize..end as usize])
    }
}
