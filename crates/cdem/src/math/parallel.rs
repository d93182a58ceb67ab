//! Grain sizes of work that is shared out among threads.

/// Nodes that a thread takes at once.
pub(crate) const NODES_AT_ONCE: usize = 4096;
