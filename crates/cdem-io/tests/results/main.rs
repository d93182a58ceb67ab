//! Results folders, as others find them.

mod fake;
mod folder;
mod frames;
mod tables;
