//! The bounds on motion of a candidate, which mostly tell without a test if it is near.

use crate::contact::surface::Pair;
use crate::contact::tolerances::{BOUND_SLACK, CULLING_RATE};

/// A pair within the allowances of the last broad phase, with its bounds on motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) pair: Pair,
    pub(crate) blocks: [u32; 2],
    pub(super) distance: MeasuredLength,
    pub(super) exclusion: MeasuredLength,
}

/// A distance or an exclusion length, m, and the travels of both blocks when it was measured, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredLength {
    /// NaN before the first measurement.
    pub(super) length: f64,
    pub(super) travel: f64,
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

impl Bounded {
    /// Returns true if the bound is near or, where it does not tell, if the measurement `is_near`.
    pub(super) fn or_measured(self, is_near: impl FnOnce() -> bool) -> bool {
        match self {
            Self::Apart => false,
            Self::Near => true,
            Self::Open => is_near(),
        }
    }

    /// Returns the result for a pair that is near only if both bounds are.
    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Apart, _) | (_, Self::Apart) => Self::Apart,
            (Self::Near, Self::Near) => Self::Near,
            _ => Self::Open,
        }
    }
}

impl MeasuredLength {
    /// Returns the result of the bound that the length changes by at most `rate` times the travel: a
    /// pair is near if its length is no more than `reach`, m.
    fn bounded(self, travel: f64, rate: f64, [reach, slack]: [f64; 2]) -> Bounded {
        let change = rate * (travel - self.travel);
        if self.length - change > reach + slack {
            Bounded::Apart
        } else if self.length + change <= reach - slack {
            Bounded::Near
        } else {
            Bounded::Open
        }
    }
}

impl Candidate {
    /// Creates a candidate of this `distance`, m, at travel 0.
    pub(in crate::contact::detection) fn new(pair: Pair, blocks: [u32; 2], distance: f64) -> Self {
        let measured = |length| MeasuredLength {
            length,
            travel: 0.0,
        };
        Self {
            pair,
            blocks,
            distance: measured(distance),
            exclusion: measured(f64::NAN),
        }
    }

    /// Returns true if the pair surely is not near once its blocks have travelled `further` in all,
    /// m, beyond their `travel`, or their motion bounds have grown by as much.
    pub(crate) fn is_apart(&self, travel: Travel, further: f64, resolution: f64) -> bool {
        let travel = Travel {
            travel: travel.travel + further,
            ..travel
        };
        self.bounded(travel, resolution) == Bounded::Apart
    }

    /// Returns the result of the bound on the distance.
    pub(super) fn distance_bounded(
        &self,
        Travel { travel, motion }: Travel,
        resolution: f64,
    ) -> Bounded {
        let limits = [motion + resolution, BOUND_SLACK * resolution];
        self.distance.bounded(travel, 1.0, limits)
    }

    /// Returns the result of the bound on the exclusion length.
    pub(super) fn exclusion_bounded(
        &self,
        Travel { travel, motion }: Travel,
        resolution: f64,
    ) -> Bounded {
        let limits = [motion, BOUND_SLACK * resolution];
        self.exclusion.bounded(travel, CULLING_RATE, limits)
    }

    /// Returns what the bounds tell of the pair.
    pub(super) fn bounded(&self, travel: Travel, resolution: f64) -> Bounded {
        let distance = self.distance_bounded(travel, resolution);
        distance.and(self.exclusion_bounded(travel, resolution))
    }

    /// Returns a lower bound of the distance after some travel of both blocks, m.
    pub(super) fn distance_after(&self, travel: f64) -> f64 {
        self.distance.length - (travel - self.distance.travel)
    }
}
