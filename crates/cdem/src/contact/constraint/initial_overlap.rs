//! Initial overlaps: penetration of blocks at t = 0 within the contact tolerance, as the user
//! placed them. The same depth does not count as penetration when the blocks touch later, at
//! any point.

use std::collections::BTreeMap;

use crate::contact::constraint::context::ContactContext;
use crate::contact::surface::{Configuration, Pair};

/// Depth of the overlap of two blocks at t = 0, m. The smaller block index comes first.
#[derive(Clone, Debug, Default)]
pub(crate) struct InitialOverlaps {
    depth: BTreeMap<[u32; 2], f64>,
}

impl InitialOverlaps {
    /// Returns the deepest overlap of each two blocks, over pairs that touch.
    pub(crate) fn of<const D: usize>(
        context: &ContactContext<D>,
        pairs: &[Pair],
        at: Configuration<D>,
    ) -> Self {
        let mut overlaps = Self::default();
        for &pair in pairs {
            let depth = -context.surface.gap_or_zero(pair, at);
            if depth > 0.0 {
                let blocks = ordered(context.blocks(pair));
                let deepest = overlaps.depth.entry(blocks).or_insert(depth);
                *deepest = depth.max(*deepest);
            }
        }
        overlaps
    }

    /// Returns the depth of the deepest overlap, m; 0 if there is none.
    pub(crate) fn deepest(&self) -> f64 {
        self.depth.values().copied().fold(0.0, f64::max)
    }

    /// Returns the part of a gap between two blocks that does not count as penetration, m: at
    /// most 0.
    pub(crate) fn allowed_gap(&self, blocks: [u32; 2], gap: f64) -> f64 {
        let depth = self.depth.get(&ordered(blocks)).copied();
        gap.clamp(-depth.unwrap_or(0.0), 0.0)
    }
}

/// Returns two blocks in rising order.
pub(crate) fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
