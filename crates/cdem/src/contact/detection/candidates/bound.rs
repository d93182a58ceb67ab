//! The bound on motion of a candidate, which mostly tells without a test if it is near.

use crate::contact::surface::Pair;
use crate::contact::tolerances::{BOUND_SLACK, CULLING_RATE};

/// A pair within the allowances of the last broad phase, with its bound on motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) pair: Pair,
    pub(crate) blocks: [u32; 2],
    /// Travels of both blocks at the last test, m.
    pub(super) travel: f64,
    /// Distance of the features then, m.
    pub(super) distance: f64,
    /// Exclusion length then, m; NaN if the distance was too large to compute it.
    pub(super) exclusion: f64,
}

/// Result of a bound on motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Bounded {
    /// The pair is surely not near.
    Apart,
    /// It is surely near.
    Near,
    /// It must be tested.
    Open,
}

/// Travel and motion bound of a block, or of the two blocks of a pair together, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Travel {
    /// Travel since the last broad phase.
    pub(crate) travel: f64,
    /// Motion bound of the step.
    pub(crate) motion: f64,
}

impl Travel {
    /// Returns the sums for two blocks.
    pub(crate) fn together([a, b]: [Self; 2]) -> Self {
        Self {
            travel: a.travel + b.travel,
            motion: a.motion + b.motion,
        }
    }

    /// Returns the part of the distance that is used up, m.
    pub(crate) fn reach(self) -> f64 {
        self.travel + self.motion
    }

    /// Returns the part of the exclusion length that is used up, m.
    pub(crate) fn turning(self) -> f64 {
        CULLING_RATE * self.travel + self.motion
    }
}

impl Candidate {
    /// Creates a candidate of this `distance`, m, at travel 0.
    pub(in crate::contact::detection) fn new(pair: Pair, blocks: [u32; 2], distance: f64) -> Self {
        Self {
            pair,
            blocks,
            travel: 0.0,
            distance,
            exclusion: f64::NAN,
        }
    }

    /// Returns true if the pair surely is not near once its blocks have travelled `further` in all,
    /// m, beyond their `travel`, or their motion bounds have grown by as much.
    pub(crate) fn is_apart(&self, travel: Travel, further: f64, resolution: f64) -> bool {
        let slack = BOUND_SLACK * resolution;
        self.distance + self.travel > travel.reach() + further + resolution + slack
            || self.exclusion + CULLING_RATE * self.travel
                > travel.turning() + CULLING_RATE * further + slack
    }

    /// Returns true if the pair is surely near.
    fn is_near(&self, Travel { travel, motion }: Travel, resolution: f64) -> bool {
        let (way, slack) = (travel - self.travel, BOUND_SLACK * resolution);
        self.distance + way <= motion + resolution - slack
            && self.exclusion + CULLING_RATE * way <= motion - slack
    }

    /// Returns what the bound tells of the pair.
    pub(super) fn bounded(&self, travel: Travel, resolution: f64) -> Bounded {
        if self.is_apart(travel, 0.0, resolution) {
            Bounded::Apart
        } else if self.is_near(travel, resolution) {
            Bounded::Near
        } else {
            Bounded::Open
        }
    }

    /// Returns a lower bound of the distance after some travel of both blocks, m.
    pub(super) fn distance_after(&self, travel: f64) -> f64 {
        self.distance - (travel - self.travel)
    }
}
