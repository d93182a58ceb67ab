//! Largest nodal values in each block.

use rayon::prelude::*;

use crate::math::parallel::NODES_AT_ONCE;

/// The largest of `N` numbers of each node, none below 0, for each block, computed on all threads.
#[derive(Clone, Debug)]
pub(crate) struct BlockMax<const N: usize> {
    /// For each chunk of nodes: block and largest values of each run of nodes of one block.
    of_nodes: Vec<Vec<(u32, [f64; N])>>,
    of_blocks: Vec<[f64; N]>,
}

impl<const N: usize> Default for BlockMax<N> {
    fn default() -> Self {
        Self {
            of_nodes: Vec::new(),
            of_blocks: Vec::new(),
        }
    }
}

impl<const N: usize> BlockMax<N> {
    /// Computes the largest values of `blocks` blocks. `block_of` lists the block of each node, and
    /// `of` gives the numbers of a node. The result is 0 for a block without nodes.
    pub(crate) fn find(
        &mut self,
        block_of: &[u32],
        blocks: usize,
        of: impl Fn(u32) -> [f64; N] + Sync,
    ) -> &[[f64; N]] {
        let some = block_of.par_chunks(NODES_AT_ONCE);
        self.of_nodes.resize_with(some.len(), Vec::new);
        let some = self.of_nodes.par_iter_mut().zip(some).enumerate();
        some.for_each(|(part, (largest, block_of))| {
            largest.clear();
            let (mut block, mut most) = (block_of[0], [0.0; N]);
            for (node, &other) in ((part * NODES_AT_ONCE) as u32..).zip(block_of) {
                if other != block {
                    largest.push((block, most));
                    (block, most) = (other, [0.0; N]);
                }
                most = larger(most, of(node));
            }
            largest.push((block, most));
        });
        self.of_blocks.clear();
        self.of_blocks.resize(blocks, [0.0; N]);
        for &(block, most) in self.of_nodes.iter().flatten() {
            let of_block = &mut self.of_blocks[block as usize];
            *of_block = larger(*of_block, most);
        }
        &self.of_blocks
    }

    /// Returns the result of the last [`Self::find`].
    pub(crate) fn of_blocks(&self) -> &[[f64; N]] {
        &self.of_blocks
    }
}

/// Returns the larger of two numbers, entry by entry. A NaN is kept.
#[inline]
fn larger<const N: usize>(one: [f64; N], other: [f64; N]) -> [f64; N] {
    std::array::from_fn(|n| {
        if one[n] >= other[n] || one[n].is_nan() {
            one[n]
        } else {
            other[n]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_get_the_largest_of_their_nodes_however_many_these_are() {
        // Some blocks lie in one chunk of nodes, one lies in several, one has no nodes.
        let counts = [3, 2 * NODES_AT_ONCE + 7, 0, 1, NODES_AT_ONCE];
        let block_of: Vec<u32> = (0..).zip(counts).flat_map(|(b, n)| vec![b; n]).collect();
        let mut random = fastrand::Rng::with_seed(11);
        let numbers: Vec<f64> = block_of.iter().map(|_| 1.0 + random.f64()).collect();
        let mut largest = BlockMax::default();
        // The second round has smaller values: nothing of the first may remain.
        for share in [1.0, 0.5] {
            let of = |node: u32| [share * numbers[node as usize], 2.0];
            let found = largest.find(&block_of, counts.len(), of);
            for ((block, count), found) in (0..).zip(counts).zip(found) {
                let own = block_of
                    .iter()
                    .zip(&numbers)
                    .filter(|(of, _)| **of == block);
                let mut own: Vec<f64> = own.map(|(_, number)| share * number).collect();
                own.sort_by(f64::total_cmp);
                let second = if count > 0 { 2.0 } else { 0.0 };
                assert_eq!(*found, [own.pop().unwrap_or_default(), second]);
            }
        }
        assert_eq!(largest.find(&[], 1, |_| [1.0, 1.0]), [[0.0; 2]]);
    }

    #[test]
    fn what_is_not_a_number_is_not_lost() {
        for place in 0..3 {
            let of = |node: u32| [if node == place { f64::NAN } else { 1.0 }];
            assert!(BlockMax::default().find(&[0; 3], 1, of)[0][0].is_nan());
        }
    }
}
