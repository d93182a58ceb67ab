//! Common motion bounds of blocks that may touch each other, because the fastest may hand on its
//! velocity.

use rayon::prelude::*;

use crate::contact::detection::candidates::{
    ActiveSubset, CandidateSearch, SearchContext, SearchWorkspace,
};
use crate::contact::surface::Configuration;
use crate::contact::tolerances::BOUND_CHECKS_PER_TASK;

impl<const D: usize> CandidateSearch<D> {
    /// Gives blocks that may touch each other the largest motion bound among them. Tests the
    /// candidates of blocks with an increased bound again, until no bound increases.
    pub(super) fn share_among_near(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        let count = self.blocks.len();
        let SearchWorkspace {
            together, largest, ..
        } = &mut self.workspace;
        together.reset(count);
        largest.clear();
        largest.extend(self.blocks.iter().map(|reach| reach.motion_bound));
        let mut joined = 0;
        while joined < self.found.len() {
            self.list_blocks_near(joined);
            self.join_near(blocks.fixed);
            joined = self.found.len();
            self.list_blocks_near(0);
            if self.raise() {
                self.look_again(blocks, at);
            }
        }
    }

    /// Joins the listed blocks that move, and gives each set its largest motion bound.
    fn join_near(&mut self, fixed: &[bool]) {
        let SearchWorkspace {
            together,
            largest,
            of_near,
            ..
        } = &mut self.workspace;
        for of in of_near {
            if of.iter().all(|&block| !fixed[block as usize]) {
                let [a, b] = of.map(|block| largest[together.root(block) as usize]);
                together.join(of[0], of[1]);
                largest[together.root(of[0]) as usize] = a.max(b);
            }
        }
        together.flatten();
    }

    /// Gives the listed blocks the largest motion bound of their set. Returns true if any bound
    /// increases.
    fn raise(&mut self) -> bool {
        let SearchWorkspace {
            together,
            largest,
            of_near,
            raised,
            ..
        } = &mut self.workspace;
        raised.clear();
        raised.resize(self.blocks.len(), false);
        for &block in of_near.as_flattened() {
            let share = &mut self.blocks[block as usize].motion_bound;
            let most = largest[together.root(block) as usize];
            if most > *share {
                *share = most;
                raised[block as usize] = true;
            }
        }
        raised.contains(&true)
    }

    /// Lists the blocks of the near pairs from the `first` on, without equal neighbours.
    fn list_blocks_near(&mut self, first: usize) {
        let found = self.found[first..]
            .par_iter()
            .with_min_len(BOUND_CHECKS_PER_TASK);
        let blocks = found.map(|&number| self.candidates[number as usize].blocks);
        blocks.collect_into_vec(&mut self.workspace.of_near);
        self.workspace.of_near.dedup();
    }

    /// Tests the candidates of blocks with an increased motion bound that have not been near.
    fn look_again(&mut self, blocks: &SearchContext<D>, at: Configuration<D>) {
        self.motion_ahead(blocks.tolerance);
        let SearchWorkspace {
            ahead,
            raised,
            glances,
            open,
            active_candidates,
            is_near,
            ..
        } = &mut self.workspace;
        let is_open = |number: &u32| {
            let candidate = &self.candidates[*number as usize];
            let [a, b] = candidate.blocks.map(|block| ahead[block as usize]);
            let mut of = candidate.blocks.iter();
            of.any(|&block| raised[block as usize])
                && !is_near[*number as usize]
                && candidate.may_be_near(a, b)
        };
        let some = active_candidates.numbers.par_chunks(BOUND_CHECKS_PER_TASK);
        glances.resize_with(some.len(), ActiveSubset::default);
        some.zip(&mut *glances).for_each(|(numbers, glance)| {
            glance.open.clear();
            glance
                .open
                .extend(numbers.iter().filter(|number| is_open(number)));
        });
        open.clear();
        open.extend(glances.iter().flat_map(|glance| &glance.open));
        self.test_pair(blocks, at);
    }
}
