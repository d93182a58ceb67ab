//! What blocks lie in each other by at t = 0, within the tolerance: how the user has put
//! them. As much is no penetration when they touch later, wherever that is.

use std::collections::BTreeMap;

use crate::contact::constraint::context::ContactContext;
use crate::contact::surface::{Configuration, Pair};

/// How deep blocks lay in each other at t = 0, m, with the smaller number first.
#[derive(Clone, Debug, Default)]
pub(crate) struct InitialOverlaps {
    depth: BTreeMap<[u32; 2], f64>,
}

impl InitialOverlaps {
    /// The deepest of some pairs that touch, by blocks.
    pub(crate) fn of<const D: usize>(
        context: &ContactContext<D>,
        pairs: &[Pair],
        at: Configuration<D>,
    ) -> Self {
        let mut overlaps = Self::default();
        for &pair in pairs {
            let depth = -context.surface.project(pair, at).gap;
            if depth > 0.0 {
                let blocks = ordered(context.blocks(pair));
                let deepest = overlaps.depth.entry(blocks).or_insert(depth);
                *deepest = depth.max(*deepest);
            }
        }
        overlaps
    }

    /// How much of a gap between two blocks is no penetration, m: at most 0.
    pub(crate) fn allowed_gap(&self, blocks: [u32; 2], gap: f64) -> f64 {
        let depth = self.depth.get(&ordered(blocks)).copied();
        gap.clamp(-depth.unwrap_or(0.0), 0.0)
    }
}

/// Two blocks, whichever is the main one.
pub(crate) fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
