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

    /// Selects the active ones of all `candidates`. The blocks have these travel bounds `ahead`,
    /// and `share` is the largest motion bound of a block, m.
    pub(super) fn sort_out(&mut self, candidates: &[Candidate], ahead: &[BlockTravel], share: f64) {
        let serves = ACTIVE_STEPS * share;
        let sort_out = |(part, (numbers, candidates)): (usize, (&mut Vec<u32>, &[Candidate]))| {
            let may_be = |candidate: &Candidate| {
                let [a, b] = candidate.blocks.map(|block| ahead[block as usize]);
                let [far, other] = [a, b].map(|ahead| ahead.further(ACTIVE_MARGIN * serves));
                a.way + b.way <= candidate.near_until || candidate.may_be_near(far, other)
            };
            let numbered = ((part * BOUND_CHECKS_PER_TASK) as u32..).zip(candidates);
            let some = numbered.filter(|(_, candidate)| may_be(candidate));
            numbers.clear();
            numbers.extend(some.map(|(number, _)| number));
        };
        let some = candidates.par_chunks(BOUND_CHECKS_PER_TASK);
        self.parts.resize_with(some.len(), Vec::new);
        let parts = self.parts.par_iter_mut().zip(some);
        parts.enumerate().for_each(sort_out);
        self.numbers.clear();
        self.numbers.extend(self.parts.iter().flatten());
        self.then.clear();
        self.then.extend(ahead);
        self.serves = serves;
    }

    /// Returns true if the list contains all candidates that may be near for these travel bounds
    /// `ahead`.
    pub(super) fn serves(&self, ahead: &[BlockTravel]) -> bool {
        let serves = |(now, then): (&BlockTravel, &BlockTravel)| {
            now.distance - then.distance <= self.serves
                && now.turning - then.turning <= CULLING_RATE * self.serves
        };
        self.then.len() == ahead.len() && ahead.iter().zip(&self.then).all(serves)
    }
}

impl BlockTravel {
    /// Returns the bounds after a further travel of the block by `way`, m.
    fn further(self, way: f64) -> Self {
        Self {
            way: self.way,
            distance: self.distance + way,
            turning: self.turning + CULLING_RATE * way,
        }
    }
}
