//! The second scale in a checkpoint.

use std::borrow::Cow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::math::restore::{ResumeError, require};
use crate::refinement::adaptivity::Adaptivity;
use crate::refinement::impact_history::ImpactHistory;
use crate::refinement::indicator::RefinementLimit;
use crate::refinement::refined_block::{MOST_THROUGHOUT, RefinedBlock};
use crate::refinement::zone::Zone;

/// What the second scale keeps from step to step: the fields of [`Adaptivity`]. A cover is
/// made anew of the zones that it has.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SavedScale<'a, const D: usize> {
    zones: Cow<'a, [Vec<Zone<D>>]>,
    made: Cow<'a, [usize]>,
    refused: Cow<'a, [Vec<Zone<D>>]>,
    why_refused: Cow<'a, [RefinementLimit]>,
    /// How often all elements of each block that has a cover are halved.
    throughout: Vec<Option<i32>>,
    stays: Cow<'a, [u64]>,
    waiting: Cow<'a, [usize]>,
    debts: Cow<'a, [f64]>,
    still: Cow<'a, [bool]>,
    impacts: Cow<'a, ImpactHistory>,
}

impl<const D: usize> Adaptivity<D> {
    /// What a checkpoint holds of it.
    pub(crate) fn saved(&self) -> SavedScale<'_, D> {
        let throughout =
            |cover: &Option<RefinedBlock<D>>| cover.as_ref().map(RefinedBlock::throughout);
        SavedScale {
            zones: Cow::Borrowed(&self.zones),
            made: Cow::Borrowed(&self.made),
            refused: Cow::Borrowed(&self.refused),
            why_refused: Cow::Borrowed(&self.why_refused),
            throughout: self.covers.iter().map(throughout).collect(),
            stays: Cow::Borrowed(&self.stays),
            waiting: Cow::Borrowed(&self.waiting),
            debts: Cow::Borrowed(&self.debts),
            still: Cow::Borrowed(&self.still),
            impacts: Cow::Borrowed(&self.impacts),
        }
    }

    /// Goes on with what was saved.
    ///
    /// # Errors
    /// When that is not of these blocks.
    pub(crate) fn restore(&mut self, saved: SavedScale<D>) -> Result<(), ResumeError> {
        self.check(&saved)?;
        let blocks = saved.throughout.par_iter().enumerate();
        let covers = blocks.map(|(block, throughout)| {
            let zones = &saved.zones[block][..saved.made[block]];
            let cover =
                throughout.map(|times| RefinedBlock::new(&self.foundation, block, zones, times));
            match cover {
                None => Ok(None),
                Some(Ok(Some(cover))) => Ok(Some(cover)),
                Some(_) => Err(ResumeError::Misfit("its refined blocks")),
            }
        });
        self.covers = covers.collect::<Result<_, _>>()?;
        self.zones = saved.zones.into_owned();
        self.made = saved.made.into_owned();
        self.refused = saved.refused.into_owned();
        self.why_refused = saved.why_refused.into_owned();
        self.stays = saved.stays.into_owned();
        self.waiting = saved.waiting.into_owned();
        self.debts = saved.debts.into_owned();
        self.still = saved.still.into_owned();
        self.impacts = saved.impacts.into_owned();
        Ok(())
    }

    /// Whether all that is saved is of these blocks.
    fn check(&self, saved: &SavedScale<D>) -> Result<(), ResumeError> {
        let count = self.covers.len();
        let lists = [
            saved.zones.len(),
            saved.made.len(),
            saved.refused.len(),
            saved.why_refused.len(),
            saved.throughout.len(),
            saved.stays.len(),
            saved.debts.len(),
            saved.still.len(),
        ];
        require(lists.iter().all(|&length| length == count), "its blocks")?;
        let mut made = saved.made.iter().zip(&*saved.zones);
        let mut throughout = saved.throughout.iter().flatten();
        let fits = made.all(|(&made, zones)| made <= zones.len())
            && throughout.all(|times| (0..=MOST_THROUGHOUT).contains(times))
            && saved.waiting.iter().all(|&block| block < count)
            && saved.impacts.are_of(count);
        require(fits, "its zones")
    }
}
