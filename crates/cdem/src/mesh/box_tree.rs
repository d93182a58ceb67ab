//! Tree of boxes, for fast intersection queries.

/// Lower and upper corner.
pub(super) type Box<const D: usize> = ([f64; D], [f64; D]);

/// A balanced tree of boxes that do not move. It depends only on their order and positions, so
/// query results come in the same order every time.
pub(super) struct BoxTree<const D: usize> {
    nodes: Vec<TreeNode<D>>,
    /// Boxes and their numbers; those of a leaf are consecutive.
    items: Vec<(Box<D>, u32)>,
}

struct TreeNode<const D: usize> {
    bounds: Box<D>,
    /// The node after the whole subtree of this one.
    next: u32,
    /// Items of a leaf; empty for an inner node.
    items: std::ops::Range<u32>,
}

/// Largest number of boxes in a leaf.
const LEAF: usize = 4;

impl<const D: usize> BoxTree<D> {
    /// Builds a tree of numbered boxes.
    pub(super) fn new(items: Vec<(Box<D>, u32)>) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            items,
        };
        if !tree.items.is_empty() {
            tree.build(0, tree.items.len());
        }
        tree
    }

    /// Calls `visit` with the number of every box that meets `wanted`.
    pub(super) fn visit(&self, wanted: &Box<D>, mut visit: impl FnMut(u32)) {
        let mut index = 0;
        while let Some(node) = self.nodes.get(index) {
            if !meet(&node.bounds, wanted) {
                index = node.next as usize;
                continue;
            }
            let items = &self.items[node.items.start as usize..node.items.end as usize];
            for (_, number) in items.iter().filter(|(bounds, _)| meet(bounds, wanted)) {
                visit(*number);
            }
            index += 1;
        }
    }

    fn build(&mut self, start: usize, end: usize) {
        let items = &mut self.items[start..end];
        let bounds = items.iter().map(|(bounds, _)| *bounds).reduce(union);
        let bounds = bounds.unwrap_or(([0.0; D], [0.0; D]));
        let is_leaf = items.len() <= LEAF;
        let node = self.nodes.len();
        let range = if is_leaf {
            start as u32..end as u32
        } else {
            0..0
        };
        self.nodes.push(TreeNode {
            bounds,
            next: 0,
            items: range,
        });
        if !is_leaf {
            let extent = |i: usize| bounds.1[i] - bounds.0[i];
            let axis = (0..D)
                .max_by(|&i, &j| extent(i).total_cmp(&extent(j)))
                .unwrap_or(0);
            let middle = items.len() / 2;
            items.select_nth_unstable_by(middle, |(a, n), (b, m)| {
                let centre = |bounds: &Box<D>| bounds.0[axis] + bounds.1[axis];
                centre(a).total_cmp(&centre(b)).then(n.cmp(m))
            });
            self.build(start, start + middle);
            self.build(start + middle, end);
        }
        self.nodes[node].next = self.nodes.len() as u32;
    }
}

/// True if two boxes have a point in common.
fn meet<const D: usize>(a: &Box<D>, b: &Box<D>) -> bool {
    (0..D).all(|i| a.0[i] <= b.1[i] && b.0[i] <= a.1[i])
}

fn union<const D: usize>(a: Box<D>, b: Box<D>) -> Box<D> {
    (
        std::array::from_fn(|i| a.0[i].min(b.0[i])),
        std::array::from_fn(|i| a.1[i].max(b.1[i])),
    )
}

/// Returns the box enlarged by `margin` on all sides.
pub(super) fn widened<const D: usize>(bounds: Box<D>, margin: f64) -> Box<D> {
    (bounds.0.map(|x| x - margin), bounds.1.map(|x| x + margin))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn boxes() -> impl Strategy<Value = Vec<Box<2>>> {
        let corner = || prop::array::uniform2(0.0..10.0_f64);
        let of = |(low, extent): ([f64; 2], [f64; 2])| {
            (low, [low[0] + 0.3 * extent[0], low[1] + 0.3 * extent[1]])
        };
        prop::collection::vec((corner(), corner()).prop_map(of), 0..60)
    }

    proptest! {
        #[test]
        fn finds_what_looking_at_all_boxes_finds(all in boxes(), wanted in boxes()) {
            let tree = BoxTree::new(all.iter().copied().zip(0..).collect());
            for query in &wanted {
                let mut found = Vec::new();
                tree.visit(query, |number| found.push(number));
                found.sort_unstable();
                let numbered = (0_u32..).zip(&all);
                let expected: Vec<_> = numbered.filter(|(_, b)| meet(b, query)).map(|(n, _)| n).collect();
                prop_assert_eq!(found, expected);
            }
        }
    }
}
