//! Results folders as other programs see them.

mod fake;
mod folder;
mod frames;
mod tables;
