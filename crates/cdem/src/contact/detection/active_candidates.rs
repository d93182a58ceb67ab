//! Candidate pairs that may be near soon. All others are skipped without a test.

use rayon::prelude::*;

use crate::contact::detection::candidates::{BlockTravel, Candidate};
use crate::contact::tolerances::{
    ACTIVE_MARGIN, ACTIVE_STEPS, BOUND_CHECKS_PER_TASK, CULLING_RATE,
};

/// The active candidates, and the travel for which the list serves.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveCandidates {
    /// Their numbers, ascending.
    pub(super) numbers: Vec<u32>,
    /// The same numbers by chunks of [`BOUND_CHECKS_PER_TASK`] candidates, kept for their storage.
    parts: Vec<Vec<u32>>,
    /// Travel bounds of the blocks when the list was made, and the further travel for which it
    /// serves, m. Empty before the first list.
    then: Vec<BlockTravel>,
    serves: f64,
}

impl ActiveCandidates {
    /// Discards the list, because the candidates have changed.
    pub(super) fn forget(&mut self) {
        self.then.clear();
    }

    /// Selects the active ones of all `candidates`, for these `travel_bounds` of the blocks and
    /// the `largest_motion_bound` of a block, m.
    pub(super) fn select(
        &mut self,
        candidates: &[Candidate],
        travel_bounds: &[BlockTravel],
        largest_motion_bound: f64,
    ) {
        let serves = ACTIVE_STEPS * largest_motion_bound;
        let select = |(part, (numbers, candidates)): (usize, (&mut Vec<u32>, &[Candidate]))| {
            let may_be = |candidate: &Candidate| {
                let [a, b] = candidate.blocks.map(|block| travel_bounds[block as usize]);
                let [far, other] = [a, b].map(|bounds| bounds.further(ACTIVE_MARGIN * serves));
                a.travel + b.travel <= candidate.near_until || candidate.may_be_near(far, other)
            };
            let numbered = ((part * BOUND_CHECKS_PER_TASK) as u32..).zip(candidates);
            let some = numbered.filter(|(_, candidate)| may_be(candidate));
            numbers.clear();
            numbers.extend(some.map(|(number, _)| number));
        };
        let some = candidates.par_chunks(BOUND_CHECKS_PER_TASK);
        self.parts.resize_with(some.len(), Vec::new);
        let parts = self.parts.par_iter_mut().zip(some);
        parts.enumerate().for_each(select);
        self.numbers.clear();
        self.numbers.extend(self.parts.iter().flatten());
        self.then.clear();
        self.then.extend(travel_bounds);
        self.serves = serves;
    }

    /// Returns true if the list contains all candidates that may be near for these
    /// `travel_bounds`.
    pub(super) fn is_valid_for(&self, travel_bounds: &[BlockTravel]) -> bool {
        let is_valid = |(now, then): (&BlockTravel, &BlockTravel)| {
            now.distance - then.distance <= self.serves
                && now.turning - then.turning <= CULLING_RATE * self.serves
        };
        self.then.len() == travel_bounds.len() && travel_bounds.iter().zip(&self.then).all(is_valid)
    }
}

impl BlockTravel {
    /// Returns the bounds after a further travel of the block by `travel`, m.
    fn further(self, travel: f64) -> Self {
        Self {
            travel: self.travel,
            distance: self.distance + travel,
            turning: self.turning + CULLING_RATE * travel,
        }
    }
}
