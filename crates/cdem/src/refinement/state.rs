//! State of the adaptivity, which a restart needs.

use serde::{Deserialize, Serialize};

use crate::math::restore::{ResumeError, require};
use crate::refinement::impact_history::ImpactHistory;
use crate::refinement::indicator::RefinementLimit;
use crate::refinement::refined_block::MOST_UNIFORM_HALVINGS;
use crate::refinement::zone::Zone;

/// All of the adaptivity that a restart needs. Lists have an entry for each block. Refined blocks
/// are built anew from it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct AdaptivityState<const D: usize> {
    pub(super) zones: Vec<Vec<Zone<D>>>,
    /// Number of zones that the overlay of each block has, and the zones that it could not have.
    pub(super) zones_made: Vec<usize>,
    pub(super) zones_refused: Vec<Vec<Zone<D>>>,
    /// The limit that refused the last of those zones.
    pub(super) why_refused: Vec<RefinementLimit>,
    /// Number of halvings of all elements of a block, if it is refined.
    pub(super) uniform_halvings: Vec<Option<i32>>,
    /// The last coarse step in which each block may have zones.
    pub(super) kept_until: Vec<u64>,
    /// Blocks with new zones that their overlay does not have yet.
    pub(super) waiting_blocks: Vec<usize>,
    /// Energy that changes of level and position corrections have made in each block, J.
    pub(super) energy_debts: Vec<f64>,
    /// True if a block is fixed or all its nodes are prescribed.
    pub(super) is_prescribed: Vec<bool>,
    /// History of the impacts of block pairs.
    pub(super) impact_history: ImpactHistory,
}

impl<const D: usize> AdaptivityState<D> {
    /// Returns the state of blocks without refinement.
    pub(super) fn new(blocks: usize) -> Self {
        Self {
            zones: vec![Vec::new(); blocks],
            zones_made: vec![0; blocks],
            zones_refused: vec![Vec::new(); blocks],
            why_refused: vec![RefinementLimit::Masses; blocks],
            uniform_halvings: vec![None; blocks],
            kept_until: vec![0; blocks],
            waiting_blocks: Vec::new(),
            energy_debts: vec![0.0; blocks],
            is_prescribed: vec![false; blocks],
            impact_history: ImpactHistory::default(),
        }
    }

    /// Checks that the state is of this number of blocks.
    ///
    /// # Errors
    /// If it belongs to other blocks.
    pub(super) fn check(&self, blocks: usize) -> Result<(), ResumeError> {
        let lists = [
            self.zones.len(),
            self.zones_made.len(),
            self.zones_refused.len(),
            self.why_refused.len(),
            self.uniform_halvings.len(),
            self.kept_until.len(),
            self.energy_debts.len(),
            self.is_prescribed.len(),
        ];
        require(lists.iter().all(|&length| length == blocks), "its blocks")?;
        let mut made = self.zones_made.iter().zip(&self.zones);
        let mut halvings = self.uniform_halvings.iter().flatten();
        let fits = made.all(|(&made, zones)| made <= zones.len())
            && halvings.all(|halvings| (0..=MOST_UNIFORM_HALVINGS).contains(halvings))
            && self.waiting_blocks.iter().all(|&block| block < blocks)
            && self.impact_history.are_of(blocks);
        require(fits, "its zones")
    }
}
