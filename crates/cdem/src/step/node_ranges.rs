//! Ranges of due nodes, and work on them on all threads.

use std::ops::Range;

use crate::math::parallel::NODES_AT_ONCE;
use crate::model::time_levels::MAX_LEVEL;

/// Maximum number of nodes of a range, except for nodes that must stay together. The kick data of a
/// range fits into the first-level cache of a core.
pub(super) const MAX_RANGE: usize = NODES_AT_ONCE / 16;

/// For each level, the nodes of that level or a finer one, as ranges of consecutive nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeRanges {
    of_level: Vec<Vec<Range<u32>>>,
}

impl NodeRanges {
    /// Builds the ranges of the nodes in `0..levels.len()` for which `is_active` is true. A range
    /// begins only at a node for which `may_begin` is true, or after a node that is not in it.
    pub(super) fn new(
        levels: &[u8],
        is_active: impl Fn(usize) -> bool,
        may_begin: impl Fn(usize) -> bool,
    ) -> Self {
        let active = (0..levels.len()).filter(|&node| is_active(node));
        let mut all = Self::default();
        for node in active {
            let count = all.of_level.len().max(levels[node] as usize + 1);
            all.of_level.resize(count, Vec::new());
            for ranges in &mut all.of_level[..=levels[node] as usize] {
                let follows = |range: &&mut Range<u32>| {
                    range.end as usize == node && (range.len() < MAX_RANGE || !may_begin(node))
                };
                match ranges.last_mut().filter(follows) {
                    Some(range) => range.end += 1,
                    None => ranges.push(node as u32..node as u32 + 1),
                }
            }
        }
        debug_assert!(all.of_level.len() <= MAX_LEVEL as usize + 1);
        all
    }

    /// Returns the finest level of a node.
    pub(super) fn finest(&self) -> u8 {
        self.of_level.len().saturating_sub(1) as u8
    }

    /// Returns the ranges of the nodes of level `coarsest` or finer, in order.
    pub(super) fn due(&self, coarsest: u8) -> &[Range<u32>] {
        self.of_level
            .get(coarsest as usize)
            .map_or(&[], Vec::as_slice)
    }
}

/// Applies `work` to each range of nodes and its part of the arrays, on all threads. The arrays
/// begin with the node `first`.
pub(super) fn each_range<T: Send, const N: usize>(
    ranges: &[Range<u32>],
    first: usize,
    mut arrays: [&mut [T]; N],
    work: &(impl Fn(usize, [&mut [T]; N]) + Sync),
) {
    let count = ranges.iter().map(Range::len).sum::<usize>();
    if ranges.len() > 1 && count > NODES_AT_ONCE {
        let (left, right) = ranges.split_at(ranges.len() / 2);
        let middle = right[0].start as usize;
        let mut halves = arrays.map(|array| array.split_at_mut(middle - first));
        let of_left = halves.each_mut().map(|half| std::mem::take(&mut half.0));
        let of_right = halves.map(|half| half.1);
        rayon::join(
            || each_range(left, first, of_left, work),
            || each_range(right, middle, of_right, work),
        );
        return;
    }
    for range in ranges {
        let own = range.start as usize - first..range.end as usize - first;
        let own = arrays.each_mut().map(|array| &mut array[own.clone()]);
        work(range.start as usize, own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn due_nodes_are_those_of_the_level_or_finer() {
        let all = NodeRanges::new(&[0, 2, 1, 2, 0], |node| node != 4, |_| true);
        assert_eq!(all.finest(), 2);
        let nodes = |coarsest| all.due(coarsest).iter().cloned().flatten();
        let due = [0, 1, 2, 3].map(|coarsest| nodes(coarsest).collect::<Vec<_>>());
        assert_eq!(due, [vec![0, 1, 2, 3], vec![1, 2, 3], vec![1, 3], vec![]]);
        assert_eq!(all.due(2), [1..2, 3..4]);
    }

    #[test]
    fn ranges_are_short_but_for_what_stays_together() {
        let levels = vec![0; 3 * MAX_RANGE];
        let all = NodeRanges::new(&levels, |_| true, |node| node % (MAX_RANGE + 1) == 0);
        let (one, other) = (MAX_RANGE as u32 + 1, 2 * (MAX_RANGE as u32 + 1));
        assert_eq!(
            all.due(0),
            [0..one, one..other, other..3 * MAX_RANGE as u32]
        );
    }

    #[test]
    fn work_is_done_once_to_each_node_that_is_due_with_what_is_its_own() {
        let mut random = fastrand::Rng::with_seed(5);
        let levels: Vec<u8> = (0..5 * NODES_AT_ONCE).map(|_| random.u8(0..4)).collect();
        let is_active = |node: usize| !(NODES_AT_ONCE..NODES_AT_ONCE + 100).contains(&node);
        let all = NodeRanges::new(&levels, is_active, |_| true);
        for coarsest in [0, 1, 3, 4] {
            let mut numbers: Vec<usize> = (0..levels.len()).collect();
            let mut counts = vec![0; levels.len()];
            let arrays = [&mut *numbers, &mut *counts];
            each_range(all.due(coarsest), 0, arrays, &|first, [own, counts]| {
                for (node, (own, count)) in (first..).zip(own.iter().zip(counts)) {
                    assert_eq!(node, *own);
                    *count += 1;
                }
            });
            for (node, (count, &level)) in counts.into_iter().zip(&levels).enumerate() {
                let is_due = is_active(node) && level >= coarsest;
                assert_eq!(count, usize::from(is_due));
            }
        }
    }
}
