//! Adaptivity in a checkpoint.

use rayon::prelude::*;

use crate::math::restore::ResumeError;
use crate::refinement::adaptivity::Adaptivity;
use crate::refinement::refined_block::RefinedBlock;
use crate::refinement::state::AdaptivityState;

impl<const D: usize> Adaptivity<D> {
    /// Returns the state, which a checkpoint stores.
    pub(crate) fn state(&self) -> &AdaptivityState<D> {
        &self.state
    }

    /// Continues from a stored state: builds the refined blocks from their zones.
    ///
    /// # Errors
    /// If the state is not of these blocks.
    pub(crate) fn restore(&mut self, state: AdaptivityState<D>) -> Result<(), ResumeError> {
        state.check(self.refined_blocks.len())?;
        let blocks = state.uniform_halvings.par_iter().enumerate();
        let refined_blocks = blocks.map(|(block, halvings)| {
            let Some(halvings) = *halvings else {
                return Ok(None);
            };
            let zones = &state.zones[block][..state.zones_made[block]];
            match RefinedBlock::new(&self.base_model, block, zones, halvings) {
                Ok(Some(refined_block)) => Ok(Some(refined_block)),
                _ => Err(ResumeError::Misfit("its refined blocks")),
            }
        });
        self.refined_blocks = refined_blocks.collect::<Result<_, _>>()?;
        self.state = state;
        Ok(())
    }
}
