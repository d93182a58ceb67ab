//! Asynchronous power-of-two time levels (design, section 3).
//!
//! An element of level l takes steps of Δt/2^l. Every element that shares a node with a finer one
//! is raised to the finer level: one buffer layer. Nodes that a contact or a dense mass matrix
//! joins count as one node.

use crate::math::disjoint_sets::DisjointSets;

/// The finest level that a scene may need.
pub(crate) const MAX_LEVEL: u8 = 16;

/// Returns the level of a stable step `limit`, s, for the coarse step `step`, s: the smallest l
/// with step/2^l ≤ limit. `None` beyond [`MAX_LEVEL`], and if the limit is not positive.
pub(crate) fn level_of(step: f64, limit: f64) -> Option<u8> {
    if limit.is_nan() || limit <= 0.0 {
        return None;
    }
    // A limit that equals the step up to round-off needs no finer level.
    let level = (step / limit * (1.0 - 1e-12)).log2().ceil().max(0.0);
    (level <= f64::from(MAX_LEVEL)).then_some(level as u8)
}

/// Levels of elements and nodes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Levels {
    /// Level of each element of the mesh.
    pub(crate) element: Vec<u8>,
    /// Level of each node: the finest of its elements and of the nodes joined to it.
    pub(crate) node: Vec<u8>,
}

impl Levels {
    /// Returns the levels if the own levels (`base`) of all elements are the same. Joined nodes
    /// then make no difference.
    pub(crate) fn uniform(base: &[u8], node_count: usize) -> Option<Self> {
        let (&first, rest) = base.split_first()?;
        rest.iter().all(|&level| level == first).then(|| Self {
            element: base.to_vec(),
            node: vec![first; node_count],
        })
    }
}

/// Returns the levels in use from the own levels (`base`) of the elements. One pass raises the
/// buffer layer. Then elements at joined nodes take the finest level there. The reason: element
/// forces press nodes in contact together. If an element acted in every other substep only, the
/// nodes would separate in one substep and collide in the next.
pub(crate) fn assign<'a>(
    base: &[u8],
    nodes_of: impl Fn(usize) -> &'a [u32],
    node_count: usize,
    joined: &DisjointSets,
) -> Levels {
    let root = |node: &u32| joined.root(*node) as usize;
    let finest = |element: &[u8]| {
        let mut level = vec![0; node_count];
        for (e, &l) in element.iter().enumerate() {
            for root in nodes_of(e).iter().map(root) {
                level[root] = level[root].max(l);
            }
        }
        level
    };
    let mut at_root = finest(base);
    let mut element: Vec<u8> = (0..base.len())
        .map(|e| nodes_of(e).iter().map(|n| at_root[root(n)]).max())
        .map(Option::unwrap_or_default)
        .collect();
    let is_joined = {
        let mut size = vec![0_u32; node_count];
        (0..node_count as u32).for_each(|node| size[root(&node)] += 1);
        move |root: usize| size[root] > 1
    };
    loop {
        at_root = finest(&element);
        let mut raised = false;
        for (e, level) in element.iter_mut().enumerate() {
            let roots = nodes_of(e).iter().map(root);
            let wanted = roots.filter(|&r| is_joined(r)).map(|r| at_root[r]).max();
            if wanted.is_some_and(|wanted| wanted > *level) {
                *level = wanted.unwrap_or_default();
                raised = true;
            }
        }
        if !raised {
            break;
        }
    }
    let node = (0..node_count as u32).map(|node| at_root[root(&node)]);
    Levels {
        node: node.collect(),
        element,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_is_the_smallest_that_is_stable() {
        assert_eq!(level_of(1.0, 1.0), Some(0));
        assert_eq!(level_of(1.0, 0.999), Some(1));
        assert_eq!(level_of(1.0, 0.5), Some(1));
        assert_eq!(level_of(1.0, 0.126), Some(3));
        assert_eq!(level_of(1.0, 2.0), Some(0));
        assert_eq!(level_of(1.0, f64::INFINITY), Some(0));
        assert_eq!(level_of(1.0, 1e-9), None);
        assert_eq!(level_of(1.0, 0.0), None);
        assert_eq!(level_of(1.0, f64::NAN), None);
    }

    #[test]
    fn one_buffer_layer_also_across_joined_nodes() {
        // Two bars of three elements; the second is finer by two levels.
        let nodes: Vec<[u32; 2]> = vec![[0, 1], [1, 2], [2, 3], [4, 5], [5, 6], [6, 7]];
        let base = [0, 0, 0, 2, 2, 2];
        let mut joined = DisjointSets::new(8);
        let alone = assign(&base, |e| &nodes[e], 8, &joined);
        assert_eq!(alone.element, [0, 0, 0, 2, 2, 2]);
        joined.join(3, 4);
        let touching = assign(&base, |e| &nodes[e], 8, &joined);
        assert_eq!(touching.element, [0, 0, 2, 2, 2, 2]);
        assert_eq!(touching.node, [0, 0, 2, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn elements_on_both_sides_of_joined_nodes_have_one_level() {
        // Three bars in a row. The last one is finer. Its level spreads through the middle bar,
        // which has one element, to the nearest element of the first bar.
        let nodes: Vec<[u32; 2]> = vec![[0, 1], [1, 2], [3, 4], [5, 6], [6, 7]];
        let mut joined = DisjointSets::new(8);
        joined.join(2, 3);
        joined.join(4, 5);
        let levels = assign(&[0, 0, 0, 1, 1], |e| &nodes[e], 8, &joined);
        assert_eq!(levels.element, [0, 1, 1, 1, 1]);
        assert_eq!(levels.node, [0, 1, 1, 1, 1, 1, 1, 1]);
    }
}
