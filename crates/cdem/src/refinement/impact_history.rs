//! Current impacts, their losses, and the pairs that have touched lately.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::refinement::indicator::{RefinementLimit, RefinementTarget};

/// Impacts of pairs of blocks.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct ImpactHistory {
    going: BTreeMap<[u32; 2], PastImpact>,
    /// Ended impacts that have lost more than wanted, by their limit.
    lossy: BTreeMap<RefinementLimit, LossyImpacts>,
    /// For pairs that have touched lately: the last coarse step in which that counts.
    touched_until: BTreeMap<[u32; 2], u64>,
    /// Losses of the last coarse step that belong to no impact so far, J.
    #[serde(skip)]
    unforeseen: Vec<([u32; 2], f64)>,
    /// Limits of ended impacts that the user has been told of.
    #[serde(skip)]
    told: BTreeSet<RefinementLimit>,
}

/// An impact.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct PastImpact {
    /// Largest energy of a touch in it, J.
    energy: f64,
    /// Its last coarse step.
    until: u64,
    /// Loss at first touches so far, J.
    loss: f64,
    /// Largest predicted loss of its touches, J, and the limit at that time.
    predicted_loss: f64,
    limit: Option<RefinementLimit>,
    /// The approach of that prediction.
    approach: Approach,
    /// A block of it that could not be refined, and the reason.
    refused: Option<(u32, RefinementLimit)>,
}

/// Time of the first touch of two blocks, s, and their largest approach speed, m/s.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Approach {
    pub(crate) time: f64,
    pub(crate) speed: f64,
}

/// Impacts that have lost more than wanted, for one reason.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct LossyImpacts {
    pub(super) count: u64,
    /// The first of them.
    pub(super) blocks: [u32; 2],
    pub(super) approach: Approach,
    /// Its loss over its energy.
    pub(super) loss_fraction: f64,
}

impl ImpactHistory {
    /// Returns the energy of the impact of two blocks, J, after a touch of this `energy`, and
    /// continues it until the step `until`. Contacts that open and close again in it are no new
    /// impact.
    pub(super) fn record_energy(&mut self, blocks: [u32; 2], energy: f64, until: u64) -> f64 {
        let unforeseen = &self.unforeseen;
        let own = || unforeseen.iter().filter(|(of, _)| *of == blocks);
        let impact = self.going.entry(blocks).or_insert_with(|| PastImpact {
            energy,
            until,
            loss: own().map(|(_, loss)| loss).sum(),
            predicted_loss: 0.0,
            limit: None,
            approach: Approach::default(),
            refused: None,
        });
        impact.energy = impact.energy.max(energy);
        impact.until = impact.until.max(until);
        impact.energy
    }

    /// Continues the impact of two blocks, if there is one, until the step `until`.
    pub(super) fn go_on(&mut self, blocks: [u32; 2], until: u64) {
        if let Some(impact) = self.going.get_mut(&blocks) {
            impact.until = impact.until.max(until);
        }
    }

    /// Records the refinement target of an impact if its predicted loss is the largest so far.
    pub(super) fn record_target(
        &mut self,
        blocks: [u32; 2],
        target: &RefinementTarget,
        approach: Approach,
    ) {
        if let Some(impact) = self.going.get_mut(&blocks)
            && target.loss >= impact.predicted_loss
        {
            (impact.predicted_loss, impact.limit) = (target.loss, target.limit);
            impact.approach = approach;
        }
    }

    /// Adds losses of pairs at first touches in a coarse step, J, to their impacts.
    pub(super) fn record_losses(&mut self, losses: impl Iterator<Item = ([u32; 2], f64)>) {
        self.unforeseen.clear();
        for (blocks, loss) in losses {
            match self.going.get_mut(&blocks) {
                Some(impact) => impact.loss += loss,
                None => self.unforeseen.push((blocks, loss)),
            }
        }
    }

    /// Returns true while an impact of two blocks goes on.
    pub(super) fn has_impact(&self, blocks: [u32; 2]) -> bool {
        self.going.contains_key(&blocks)
    }

    /// Records that two blocks touch, which counts until the step `until`.
    pub(super) fn record_touch(&mut self, blocks: [u32; 2], until: u64) {
        self.touched_until.insert(blocks, until);
    }

    /// Returns true if two blocks have touched lately.
    pub(super) fn has_touched(&self, blocks: [u32; 2]) -> bool {
        self.touched_until.contains_key(&blocks)
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
        let lossy = self.lossy.values().map(|lossy| &lossy.blocks);
        let pairs = self.going.keys().chain(self.touched_until.keys());
        let mut all = pairs.chain(lossy).flatten();
        all.all(|&block| (block as usize) < blocks)
    }

    /// Ends the impacts and touches whose last step is before `number`. Counts the impacts that
    /// have lost more than a fraction `wanted` of their energy.
    pub(super) fn end(&mut self, number: u64, wanted: f64) {
        let Self {
            going,
            lossy,
            touched_until,
            ..
        } = self;
        touched_until.retain(|_, until| *until >= number);
        going.retain(|blocks, impact| {
            let goes_on = impact.until >= number;
            if !goes_on {
                impact.count(*blocks, wanted, lossy);
            }
            goes_on
        });
    }

    /// Returns the ended impacts that have lost more than wanted, by their limit, if the limit is
    /// new since the last call.
    pub(super) fn take_new(&mut self) -> Vec<(RefinementLimit, LossyImpacts)> {
        let Self { lossy, told, .. } = self;
        let new = lossy.iter().filter(|(limit, _)| told.insert(**limit));
        new.map(|(&limit, &found)| (limit, found)).collect()
    }

    /// Returns the impacts that have lost more than a fraction `wanted` of their energy, by their
    /// limit.
    pub(super) fn lossy(&self, wanted: f64) -> BTreeMap<RefinementLimit, LossyImpacts> {
        let mut lossy = self.lossy.clone();
        for (blocks, impact) in &self.going {
            impact.count(*blocks, wanted, &mut lossy);
        }
        lossy
    }
}

impl PastImpact {
    /// Counts the impact if it has lost more than a fraction `wanted` of its energy.
    fn count(
        &self,
        blocks: [u32; 2],
        wanted: f64,
        lossy: &mut BTreeMap<RefinementLimit, LossyImpacts>,
    ) {
        if self.loss <= wanted * self.energy {
            return;
        }
        let refused = self.refused.map(|(_, limit)| limit);
        let limit = refused
            .or(self.limit)
            .unwrap_or(RefinementLimit::Prediction);
        let own = LossyImpacts {
            count: 0,
            blocks,
            approach: self.approach,
            loss_fraction: self.loss / self.energy,
        };
        let known = lossy.entry(limit).or_insert(own);
        let count = known.count + 1;
        if own.approach.time < known.approach.time {
            *known = own;
        }
        known.count = count;
    }
}
