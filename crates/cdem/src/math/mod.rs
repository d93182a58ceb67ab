//! Vectors, adjacency lists, number formats and profiling, for all modules.

pub(crate) mod adjacency;
pub(crate) mod disjoint_sets;
pub(crate) mod format;
pub(crate) mod parallel;
pub(crate) mod profile;
pub(crate) mod quadratic;
pub(crate) mod restore;
pub(crate) mod serde_pod;
pub(crate) mod vector;
