//! Contact in the plane against exact answers; run with `--nocapture` for the
//! figures.

#![allow(clippy::print_stdout)] // the figures are the report

mod bars;
mod corners;
mod crowd;
mod impacts;
mod joints;
mod many;
mod paper;
mod slope;
mod stack;
