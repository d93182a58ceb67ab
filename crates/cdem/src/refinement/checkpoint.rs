//! Adaptivity in a checkpoint.

use std::borrow::Cow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::math::restore::{ResumeError, require};
use crate::refinement::adaptivity::Adaptivity;
use crate::refinement::impact_history::ImpactHistory;
use crate::refinement::indicator::RefinementLimit;
use crate::refinement::refined_block::{MOST_THROUGHOUT, RefinedBlock};
use crate::refinement::zone::Zone;

/// The restart state of adaptivity: the fields of [`Adaptivity`]. An overlay is rebuilt from its
/// zones.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SavedScale<'a, const D: usize> {
    zones: Cow<'a, [Vec<Zone<D>>]>,
    zones_made: Cow<'a, [usize]>,
    zones_refused: Cow<'a, [Vec<Zone<D>>]>,
    why_refused: Cow<'a, [RefinementLimit]>,
    /// Number of halvings of all elements, for each refined block.
    uniform_halvings: Vec<Option<i32>>,
    kept_until: Cow<'a, [u64]>,
    waiting: Cow<'a, [usize]>,
    energy_debts: Cow<'a, [f64]>,
    is_prescribed: Cow<'a, [bool]>,
    impact_history: Cow<'a, ImpactHistory>,
}

impl<const D: usize> Adaptivity<D> {
    /// Returns the state that a checkpoint stores.
    pub(crate) fn saved(&self) -> SavedScale<'_, D> {
        let throughout = |refined_block: &Option<RefinedBlock<D>>| {
            refined_block.as_ref().map(RefinedBlock::uniform_halvings)
        };
        SavedScale {
            zones: Cow::Borrowed(&self.zones),
            zones_made: Cow::Borrowed(&self.zones_made),
            zones_refused: Cow::Borrowed(&self.zones_refused),
            why_refused: Cow::Borrowed(&self.why_refused),
            uniform_halvings: self.refined_blocks.iter().map(throughout).collect(),
            kept_until: Cow::Borrowed(&self.kept_until),
            waiting: Cow::Borrowed(&self.waiting_blocks),
            energy_debts: Cow::Borrowed(&self.energy_debts),
            is_prescribed: Cow::Borrowed(&self.is_prescribed),
            impact_history: Cow::Borrowed(&self.impact_history),
        }
    }

    /// Continues from a saved state.
    ///
    /// # Errors
    /// If the saved state is not of these blocks.
    pub(crate) fn restore(&mut self, saved: SavedScale<D>) -> Result<(), ResumeError> {
        self.check(&saved)?;
        let blocks = saved.uniform_halvings.par_iter().enumerate();
        let refined_blocks = blocks.map(|(block, throughout)| {
            let zones = &saved.zones[block][..saved.zones_made[block]];
            let refined_block =
                throughout.map(|times| RefinedBlock::new(&self.base_model, block, zones, times));
            match refined_block {
                None => Ok(None),
                Some(Ok(Some(refined_block))) => Ok(Some(refined_block)),
                Some(_) => Err(ResumeError::Misfit("its refined blocks")),
            }
        });
        self.refined_blocks = refined_blocks.collect::<Result<_, _>>()?;
        self.zones = saved.zones.into_owned();
        self.zones_made = saved.zones_made.into_owned();
        self.zones_refused = saved.zones_refused.into_owned();
        self.why_refused = saved.why_refused.into_owned();
        self.kept_until = saved.kept_until.into_owned();
        self.waiting_blocks = saved.waiting.into_owned();
        self.energy_debts = saved.energy_debts.into_owned();
        self.is_prescribed = saved.is_prescribed.into_owned();
        self.impact_history = saved.impact_history.into_owned();
        Ok(())
    }

    /// Checks that the saved state is of these blocks.
    fn check(&self, saved: &SavedScale<D>) -> Result<(), ResumeError> {
        let count = self.refined_blocks.len();
        let lists = [
            saved.zones.len(),
            saved.zones_made.len(),
            saved.zones_refused.len(),
            saved.why_refused.len(),
            saved.uniform_halvings.len(),
            saved.kept_until.len(),
            saved.energy_debts.len(),
            saved.is_prescribed.len(),
        ];
        require(lists.iter().all(|&length| length == count), "its blocks")?;
        let mut made = saved.zones_made.iter().zip(&*saved.zones);
        let mut throughout = saved.uniform_halvings.iter().flatten();
        let fits = made.all(|(&made, zones)| made <= zones.len())
            && throughout.all(|times| (0..=MOST_THROUGHOUT).contains(times))
            && saved.waiting.iter().all(|&block| block < count)
            && saved.impact_history.are_of(count);
        require(fits, "its zones")
    }
}
