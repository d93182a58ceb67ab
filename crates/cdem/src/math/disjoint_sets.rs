//! Disjoint sets (union–find).

/// Disjoint sets of nodes. The nodes of a set count as one node.
#[derive(Clone, Debug, Default)]
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Creates sets of one node each for `count` nodes.
    pub(crate) fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    /// Resets to sets of one node each for `count` nodes.
    pub(crate) fn reset(&mut self, count: usize) {
        self.parent.clear();
        self.parent.extend(0..count as u32);
    }

    /// Returns the representative of the set of `node`: its smallest member.
    pub(crate) fn root(&self, mut node: u32) -> u32 {
        while self.parent[node as usize] != node {
            node = self.parent[node as usize];
        }
        node
    }

    /// Unites the sets of two nodes.
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let roots = [self.shorten(a), self.shorten(b)];
        let root = roots[0].min(roots[1]);
        for node in [roots[0], roots[1], a, b] {
            self.parent[node as usize] = root;
        }
    }

    /// Returns the representative of the set of `node` and halves the path to it, so that a look-up
    /// is cheap in any order of unions.
    fn shorten(&mut self, node: u32) -> u32 {
        let mut node = node as usize;
        while self.parent[node] as usize != node {
            let parent = self.parent[node] as usize;
            self.parent[node] = self.parent[parent];
            node = self.parent[node] as usize;
        }
        node as u32
    }

    /// Makes every path one step long.
    pub(crate) fn flatten(&mut self) {
        // A parent is smaller than its child, so its own path is already flat.
        for node in 0..self.parent.len() {
            self.parent[node] = self.parent[self.parent[node] as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn joined_nodes_have_the_smallest_of_them_for_root(
            joins in proptest::collection::vec((0..30_u32, 0..30_u32), 0..40),
        ) {
            let mut joined = DisjointSets::new(30);
            // Smallest node of each set, found by propagation until nothing changes.
            let mut smallest: Vec<u32> = (0..30).collect();
            for &(a, b) in &joins {
                joined.join(a, b);
            }
            for _ in 0..30 {
                for &(a, b) in &joins {
                    let least = smallest[a as usize].min(smallest[b as usize]);
                    smallest[a as usize] = least;
                    smallest[b as usize] = least;
                }
            }
            let roots = |joined: &DisjointSets| (0..30).map(|node| joined.root(node)).collect::<Vec<_>>();
            prop_assert_eq!(roots(&joined), &*smallest);
            joined.flatten();
            prop_assert_eq!(&joined.parent, &smallest);
        }
    }
}
