//! Current impacts, and the limits of those that lose too much.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::refinement::indicator::{RefinementLimit, RefinementTarget};

/// Impacts of pairs of blocks.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct ImpactHistory {
    going: BTreeMap<[u32; 2], PastImpact>,
    /// Ended impacts that lost more than wanted, by their limit.
    limited: BTreeMap<RefinementLimit, LimitedImpacts>,
}

/// An impact.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct PastImpact {
    /// Largest energy of a touch in it, J.
    energy: f64,
    /// Its last coarse step.
    until: u64,
    /// Largest predicted loss of its touches, J, and the limit at that time.
    loss: f64,
    limit: Option<RefinementLimit>,
    /// Time, s, and speed, m/s, of that prediction.
    time: f64,
    speed: f64,
    /// A block of it that could not be refined, and the reason.
    refused: Option<(u32, RefinementLimit)>,
}

/// Impacts that lose more than wanted, for one reason.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct LimitedImpacts {
    pub(super) count: u64,
    /// The first of them: its blocks, time, s, and speed, m/s.
    pub(super) blocks: [u32; 2],
    pub(super) time: f64,
    pub(super) speed: f64,
    /// Its predicted loss over its energy.
    pub(super) loss_fraction: f64,
}

impl ImpactHistory {
    /// Returns the energy of the impact of two blocks, J, after a touch of this `energy`, and
    /// continues it until the step `until`. Contacts that open and close again in it are no new
    /// impact.
    pub(super) fn record_energy(&mut self, blocks: [u32; 2], energy: f64, until: u64) -> f64 {
        let impact = self.going.entry(blocks).or_insert(PastImpact {
            energy,
            until,
            loss: 0.0,
            limit: None,
            time: 0.0,
            speed: 0.0,
            refused: None,
        });
        impact.energy = impact.energy.max(energy);
        impact.until = impact.until.max(until);
        impact.energy
    }

    /// Records the refinement target of an impact at a time, s, and a speed, m/s, if its loss is
    /// the largest so far.
    pub(super) fn record_target(
        &mut self,
        blocks: [u32; 2],
        target: &RefinementTarget,
        [time, speed]: [f64; 2],
    ) {
        if let Some(impact) = self.going.get_mut(&blocks)
            && target.loss >= impact.loss
        {
            (impact.loss, impact.limit) = (target.loss, target.limit);
            (impact.time, impact.speed) = (time, speed);
        }
    }

    /// Records which of some `blocks`, sorted, could not be refined for their impacts, and the
    /// reasons.
    pub(super) fn refine(&mut self, blocks: &[usize], refused: &BTreeMap<usize, RefinementLimit>) {
        for (pair, impact) in &mut self.going {
            for &block in pair {
                if blocks.binary_search(&(block as usize)).is_err() {
                    continue;
                }
                match (refused.get(&(block as usize)), impact.refused) {
                    (Some(&limit), _) => impact.refused = Some((block, limit)),
                    (None, Some((known, _))) if known == block => impact.refused = None,
                    _ => {}
                }
            }
        }
    }

    /// Records that a block could not be refined for the impact of two blocks, and the reason.
    pub(super) fn refuse(&mut self, [a, b]: [u32; 2], block: usize, limit: RefinementLimit) {
        if let Some(impact) = self.going.get_mut(&[a.min(b), a.max(b)]) {
            impact.refused = Some((block as u32, limit));
        }
    }

    /// Returns true if all block numbers are below `blocks`.
    pub(super) fn are_of(&self, blocks: usize) -> bool {
        let limited = self.limited.values().map(|limited| &limited.blocks);
        let mut all = self.going.keys().chain(limited).flatten();
        all.all(|&block| (block as usize) < blocks)
    }

    /// Ends the impacts whose last step is before `number`.
    pub(super) fn end(&mut self, number: u64) {
        let Self { going, limited } = self;
        going.retain(|blocks, impact| {
            let goes_on = impact.until >= number;
            if !goes_on {
                impact.count(*blocks, limited);
            }
            goes_on
        });
    }

    /// Returns the impacts that lose more than wanted, by their limit.
    pub(super) fn limited(&self) -> BTreeMap<RefinementLimit, LimitedImpacts> {
        let mut limited = self.limited.clone();
        for (blocks, impact) in &self.going {
            impact.count(*blocks, &mut limited);
        }
        limited
    }
}

impl PastImpact {
    /// Counts the impact if it loses too much.
    fn count(&self, blocks: [u32; 2], limited: &mut BTreeMap<RefinementLimit, LimitedImpacts>) {
        let Some(limit) = self.refused.map(|(_, limit)| limit).or(self.limit) else {
            return;
        };
        let own = LimitedImpacts {
            count: 0,
            blocks,
            time: self.time,
            speed: self.speed,
            loss_fraction: self.loss / self.energy,
        };
        let known = limited.entry(limit).or_insert(own);
        let count = known.count + 1;
        if own.time < known.time {
            *known = own;
        }
        known.count = count;
    }
}
