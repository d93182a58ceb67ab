//! Penetration of two blocks.

use serde::{Deserialize, Serialize};

/// Penetration at a contact. The deepest one of a run is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Penetration {
    /// Depth, m; 0 or less if there is none.
    pub(crate) depth: f64,
    /// Time, s.
    pub(crate) time: f64,
    /// Main and target block.
    pub(crate) blocks: [u32; 2],
}

impl Penetration {
    /// Takes another penetration if it is deeper.
    pub(crate) fn include(&mut self, other: Self) {
        if other.depth > self.depth {
            *self = other;
        }
    }
}
