//! Grain sizes of parallel work.

/// Number of nodes that a thread takes at once.
pub(crate) const NODES_AT_ONCE: usize = 4096;
