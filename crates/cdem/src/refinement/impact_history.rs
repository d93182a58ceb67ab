//! Collisions for as long as they last, and what those that lose too much were kept from.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::refinement::indicator::{RefinementLimit, RefinementTarget};

/// Collisions of pairs of blocks.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct ImpactHistory {
    going: BTreeMap<[u32; 2], PastImpact>,
    /// Those that have ended and lost more than is wanted, by what kept them from less.
    limited: BTreeMap<RefinementLimit, LimitedImpacts>,
}

/// A collision.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct PastImpact {
    /// Most that a touch in it has had, J.
    energy: f64,
    /// The last coarse step of it.
    until: u64,
    /// Most that its touches were to lose at a look, J, and what kept them from less.
    loss: f64,
    limit: Option<RefinementLimit>,
    /// When it was looked at then, s, and how fast it was, m/s.
    time: f64,
    speed: f64,
    /// A block of it that could not be refined, and why.
    refused: Option<(u32, RefinementLimit)>,
}

/// Collisions that lose more than is wanted, for one reason.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct LimitedImpacts {
    pub(super) count: u64,
    /// The first of them: its blocks, when, s, and how fast, m/s.
    pub(super) blocks: [u32; 2],
    pub(super) time: f64,
    pub(super) speed: f64,
    /// What it was to lose of its energy.
    pub(super) share: f64,
}

impl ImpactHistory {
    /// Energy of the impact of two blocks that includes a touch of some energy, J, and goes
    /// on until a step: what opens and closes again in it is no impact of its own.
    pub(super) fn energy(&mut self, blocks: [u32; 2], energy: f64, until: u64) -> f64 {
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

    /// Keeps how deep an impact was to be refined at a time, s, and a speed, m/s: of all
    /// looks, that of the largest loss.
    pub(super) fn look(
        &mut self,
        blocks: [u32; 2],
        depth: &RefinementTarget,
        [time, speed]: [f64; 2],
    ) {
        if let Some(impact) = self.going.get_mut(&blocks)
            && depth.loss >= impact.loss
        {
            (impact.loss, impact.limit) = (depth.loss, depth.limit);
            (impact.time, impact.speed) = (time, speed);
        }
    }

    /// Keeps which of some blocks, sorted, could not be refined for their impacts, and why.
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

    /// Keeps that a block could not be refined for the impact of two, and why.
    pub(super) fn refuse(&mut self, [a, b]: [u32; 2], block: usize, limit: RefinementLimit) {
        if let Some(impact) = self.going.get_mut(&[a.min(b), a.max(b)]) {
            impact.refused = Some((block as u32, limit));
        }
    }

    /// Whether all are of so many blocks.
    pub(super) fn are_of(&self, blocks: usize) -> bool {
        let limited = self.limited.values().map(|limited| &limited.blocks);
        let mut all = self.going.keys().chain(limited).flatten();
        all.all(|&block| (block as usize) < blocks)
    }

    /// Ends those that do not go on until a step.
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

    /// Those that lose more than is wanted, by what keeps them from less.
    pub(super) fn limited(&self) -> BTreeMap<RefinementLimit, LimitedImpacts> {
        let mut limited = self.limited.clone();
        for (blocks, impact) in &self.going {
            impact.count(*blocks, &mut limited);
        }
        limited
    }
}

impl PastImpact {
    /// Counts it where it loses too much.
    fn count(&self, blocks: [u32; 2], limited: &mut BTreeMap<RefinementLimit, LimitedImpacts>) {
        let Some(limit) = self.refused.map(|(_, limit)| limit).or(self.limit) else {
            return;
        };
        let own = LimitedImpacts {
            count: 0,
            blocks,
            time: self.time,
            speed: self.speed,
            share: self.loss / self.energy,
        };
        let known = limited.entry(limit).or_insert(own);
        let count = known.count + 1;
        if own.time < known.time {
            *known = own;
        }
        known.count = count;
    }
}
