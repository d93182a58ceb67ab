//! The broad phase of a search, and the lists that follow from its candidates.

use rayon::prelude::*;

use crate::contact::detection::candidates::{
    Candidate, CandidateSearch, MotionBound, SearchContext,
};
use crate::contact::surface::Configuration;
use crate::contact::tolerances::{
    BROAD_PHASE_STEPS, BROAD_PHASE_STEPS_AT_REST, CANDIDATES_PER_TASK, DISTANCE_KEPT,
};

impl<const D: usize> CandidateSearch<D> {
    /// Finds all candidates anew, and sets the allowances for which they serve.
    pub(super) fn broad_phase(
        &mut self,
        blocks: &SearchContext<D>,
        at: Configuration<D>,
        may_meet: &impl Fn([u32; 2]) -> bool,
    ) {
        let moving = blocks.fixed.iter().filter(|&&fixed| !fixed).count().max(1);
        let shares = self.blocks.iter().map(|reach| reach.motion_bound);
        let mean = shares.sum::<f64>() / moving as f64;
        let least = (BROAD_PHASE_STEPS * mean).max(BROAD_PHASE_STEPS_AT_REST * blocks.tolerance);
        for (reach, &fixed) in self.blocks.iter_mut().zip(blocks.fixed) {
            *reach = MotionBound {
                motion_bound: reach.motion_bound,
                allowance: if fixed {
                    0.0
                } else {
                    least.max(BROAD_PHASE_STEPS * reach.motion_bound)
                },
                ..MotionBound::default()
            };
        }
        self.origin.clear();
        let nodes = 0..blocks.block_of.len() as u32;
        self.origin.extend(nodes.map(|node| at.at(node)));
        self.last.clone_from(&self.origin);
        let allowance = |block: u32| self.blocks[block as usize].allowance;
        let margin = |block| DISTANCE_KEPT * (allowance(block) + 0.5 * blocks.tolerance);
        let patches = blocks.clusters;
        let cache = blocks.surface.geometry_cache(patches.features(), None);
        let at = at.with(cache.as_ref());
        let pairs = patches.overlapping(blocks.surface, at, &margin, may_meet);
        let pairs = pairs.into_par_iter().with_min_len(CANDIDATES_PER_TASK);
        let candidates = pairs.map(|pair| Candidate {
            pair,
            blocks: blocks.of(pair),
            far_until: blocks.surface.distance_lower_bound(pair, at),
            excluded_until: 0.0,
            near_until: -1.0,
        });
        let within = |candidate: &Candidate| {
            let [a, b] = candidate.blocks.map(margin);
            candidate.far_until <= a + b
        };
        self.candidates = candidates.filter(within).collect();
        self.list_candidates();
    }

    /// Lists the candidates by main feature and by block.
    pub(super) fn list_candidates(&mut self) {
        self.active_candidates.forget();
        let mains = self.candidates.last().map_or(0, |last| last.pair.main + 1);
        let main = |candidate: &Candidate| candidate.pair.main as usize;
        self.of_main = starts(self.candidates.iter().map(main), mains as usize);
        let blocks = |candidate: &Candidate| candidate.blocks.map(|block| block as usize);
        let all = self.candidates.iter().flat_map(blocks);
        self.start = starts(all, self.blocks.len());
        let mut next = self.start.clone();
        self.of_block.clear();
        self.of_block.resize(2 * self.candidates.len(), 0);
        for (number, candidate) in (0..).zip(&self.candidates) {
            for block in blocks(candidate) {
                self.of_block[next[block] as usize] = number;
                next[block] += 1;
            }
        }
    }

    /// Returns the numbers of the candidates of a block.
    pub(super) fn candidates_of(&self, block: usize) -> &[u32] {
        &self.of_block[self.start[block] as usize..self.start[block + 1] as usize]
    }
}

/// Returns the index of the first item of each of `count` owners in a list sorted by owner, and the
/// end of the list.
fn starts(owners: impl Iterator<Item = usize>, count: usize) -> Vec<u32> {
    let mut start = vec![0; count + 1];
    for owner in owners {
        start[owner + 1] += 1;
    }
    for owner in 0..count {
        start[owner + 1] += start[owner];
    }
    start
}
