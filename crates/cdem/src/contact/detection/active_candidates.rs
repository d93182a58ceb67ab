//! Candidates that may be near before long: all others are passed over without a glance.

use rayon::prelude::*;

use crate::contact::detection::candidates::{BlockTravel, Candidate};
use crate::contact::tolerances::{ACTIVE_MARGIN, ACTIVE_STEPS, CULLING_RATE, GLANCES_PER_TASK};

/// The candidates, for as long as they serve.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveCandidates {
    /// Their numbers, rising.
    pub(super) numbers: Vec<u32>,
    /// The same by runs of [`GLANCES_PER_TASK`] candidates, for their storage.
    parts: Vec<Vec<u32>>,
    /// What blocks had ahead then, and by how much more it may be, m; none before the first.
    then: Vec<BlockTravel>,
    serves: f64,
}

impl ActiveCandidates {
    /// There are other candidates.
    pub(super) fn forget(&mut self) {
        self.then.clear();
    }

    /// Sorts out those of all `candidates`, whose blocks have this `ahead`, the largest share of
    /// one being `share`, m.
    pub(super) fn sort_out(&mut self, candidates: &[Candidate], ahead: &[BlockTravel], share: f64) {
        let serves = ACTIVE_STEPS * share;
        let sort_out = |(part, (numbers, candidates)): (usize, (&mut Vec<u32>, &[Candidate]))| {
            let may_be = |candidate: &Candidate| {
                let [a, b] = candidate.blocks.map(|block| ahead[block as usize]);
                let [far, other] = [a, b].map(|ahead| ahead.further(ACTIVE_MARGIN * serves));
                a.way + b.way <= candidate.held || candidate.may_be_near(far, other)
            };
            let numbered = ((part * GLANCES_PER_TASK) as u32..).zip(candidates);
            let some = numbered.filter(|(_, candidate)| may_be(candidate));
            numbers.clear();
            numbers.extend(some.map(|(number, _)| number));
        };
        let some = candidates.par_chunks(GLANCES_PER_TASK);
        self.parts.resize_with(some.len(), Vec::new);
        let parts = self.parts.par_iter_mut().zip(some);
        parts.enumerate().for_each(sort_out);
        self.numbers.clear();
        self.numbers.extend(self.parts.iter().flatten());
        self.then.clear();
        self.then.extend(ahead);
        self.serves = serves;
    }

    /// Whether all that may be near are among them, where blocks have this `ahead`.
    pub(super) fn serves(&self, ahead: &[BlockTravel]) -> bool {
        let serves = |(now, then): (&BlockTravel, &BlockTravel)| {
            now.distance - then.distance <= self.serves
                && now.turning - then.turning <= CULLING_RATE * self.serves
        };
        self.then.len() == ahead.len() && ahead.iter().zip(&self.then).all(serves)
    }
}

impl BlockTravel {
    /// The same where the block has gone on by `way`, m.
    fn further(self, way: f64) -> Self {
        Self {
            way: self.way,
            distance: self.distance + way,
            turning: self.turning + CULLING_RATE * way,
        }
    }
}
