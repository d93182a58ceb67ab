//! Common motion bounds of blocks that touch, or may touch, each other, because the fastest may hand
//! on its velocity.

use rayon::prelude::*;

use crate::contact::detection::candidates::{
    BoundCheck, CandidateSearch, SearchContext, SearchLists, Travel,
};
use crate::contact::surface::Configuration;
use crate::contact::tolerances::BOUND_CHECKS_PER_TASK;

impl<const D: usize> CandidateSearch<D> {
    /// Gives blocks that touch, or may touch, each other the largest motion bound among them. Tests
    /// the candidates of blocks with an increased bound again, until no bound increases.
    pub(super) fn spread_motion_bounds(
        &mut self,
        blocks: &SearchContext<D>,
        at: Configuration<D>,
        touching: &[[u32; 2]],
    ) {
        let count = self.blocks.len();
        let SearchLists {
            block_sets,
            set_motion_bounds,
            near_blocks,
            ..
        } = &mut self.lists;
        block_sets.reset(count);
        set_motion_bounds.clear();
        set_motion_bounds.extend(self.blocks.iter().map(|block| block.motion_bound));
        near_blocks.clear();
        near_blocks.extend(touching);
        let mut joined = 0;
        loop {
            self.join_near(blocks.fixed);
            if self.raise() {
                self.retest_raised(blocks, at);
            }
            if joined == self.found.len() {
                return;
            }
            self.list_blocks_near(joined);
            joined = self.found.len();
        }
    }

    /// Joins the listed blocks that move, and gives each set its largest motion bound.
    fn join_near(&mut self, fixed: &[bool]) {
        let SearchLists {
            block_sets,
            set_motion_bounds,
            near_blocks,
            ..
        } = &mut self.lists;
        for of in near_blocks {
            if of.iter().all(|&block| !fixed[block as usize]) {
                let [a, b] = of.map(|block| set_motion_bounds[block_sets.root(block) as usize]);
                block_sets.join(of[0], of[1]);
                set_motion_bounds[block_sets.root(of[0]) as usize] = a.max(b);
            }
        }
        block_sets.flatten();
    }

    /// Gives each block the largest motion bound of its set. Returns true if any bound increases.
    fn raise(&mut self) -> bool {
        let SearchLists {
            block_sets,
            set_motion_bounds,
            raised,
            ..
        } = &mut self.lists;
        raised.clear();
        for (number, block) in self.blocks.iter_mut().enumerate() {
            let most = set_motion_bounds[block_sets.root(number as u32) as usize];
            raised.push(most > block.motion_bound);
            block.motion_bound = block.motion_bound.max(most);
        }
        raised.contains(&true)
    }

    /// Lists the blocks of the near pairs from the `first` on, without equal neighbours.
    fn list_blocks_near(&mut self, first: usize) {
        let found = self.found[first..]
            .par_iter()
            .with_min_len(BOUND_CHECKS_PER_TASK);
        let blocks = found.map(|&number| self.candidates[number as usize].blocks);
        blocks.collect_into_vec(&mut self.lists.near_blocks);
        self.lists.near_blocks.dedup();
    }

    /// Tests the candidates of blocks with an increased motion bound that have not been near.
    fn retest_raised(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        self.update_travels(blocks.resolution);
        let Self {
            candidates,
            is_near,
            active_candidates,
            lists,
            ..
        } = self;
        let SearchLists {
            travels,
            raised,
            bound_checks,
            open,
            ..
        } = lists;
        let is_open = |number: &u32| {
            let candidate = &candidates[*number as usize];
            let travel = Travel::together(candidate.blocks.map(|block| travels[block as usize]));
            let mut of = candidate.blocks.iter();
            of.any(|&block| raised[block as usize])
                && !is_near[*number as usize]
                && !candidate.is_apart(travel, 0.0, blocks.resolution)
        };
        let some = active_candidates.numbers.par_chunks(BOUND_CHECKS_PER_TASK);
        bound_checks.resize_with(some.len(), BoundCheck::default);
        some.zip(&mut *bound_checks)
            .for_each(|(numbers, bound_check)| {
                bound_check.open.clear();
                bound_check
                    .open
                    .extend(numbers.iter().filter(|number| is_open(number)));
            });
        open.clear();
        open.extend(
            bound_checks
                .iter()
                .flat_map(|bound_check| &bound_check.open),
        );
        self.test_open(blocks, at);
    }
}
