//! Candidate pairs that may be near soon. All others are skipped without a test.

use rayon::prelude::*;

use crate::contact::detection::candidates::{Candidate, Travel};
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
    /// Travels of the blocks when the list was made, and the further travel for which it serves, m.
    /// Empty before the first list.
    then: Vec<Travel>,
    serves: f64,
}

impl ActiveCandidates {
    /// Discards the list, because the candidates have changed.
    pub(super) fn forget(&mut self) {
        self.then.clear();
    }

    /// Selects the active ones of all `candidates`, for these `travels` of the blocks.
    pub(super) fn select(&mut self, candidates: &[Candidate], travels: &[Travel], resolution: f64) {
        let largest = travels.iter().map(|of| of.motion).fold(0.0, f64::max);
        let serves = ACTIVE_STEPS * largest;
        // Either block may travel on.
        let further = 2.0 * ACTIVE_MARGIN * serves;
        let select = |(part, (numbers, candidates)): (usize, (&mut Vec<u32>, &[Candidate]))| {
            let may_be = |candidate: &Candidate| {
                let travel = Travel::together(candidate.blocks.map(|b| travels[b as usize]));
                !candidate.is_apart(travel, further, resolution)
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
        self.then.extend(travels);
        self.serves = serves;
    }

    /// Returns true if the list contains all candidates that may be near for these `travels`.
    pub(super) fn is_valid_for(&self, travels: &[Travel]) -> bool {
        let is_valid = |(now, then): (&Travel, &Travel)| {
            now.reach() - then.reach() <= self.serves
                && now.turning() - then.turning() <= CULLING_RATE * self.serves
        };
        self.then.len() == travels.len() && travels.iter().zip(&self.then).all(is_valid)
    }
}
