//! Adaptivity, the second scale: blocks are refined around impacts. Run with `--nocapture` for the
//! figures.

#![allow(clippy::print_stdout)] // the figures are the report

mod bars;
mod boxed;
mod cost;
mod flicker;
mod gaps;
mod halvings;
mod held;
mod impact;
mod joints;
mod limits;
mod long_ground;
mod meetings;
mod paper;
mod prisms;
mod resting;
mod rockfall;
mod rolling;
mod same_path;
mod sliding;
mod soft_drop;
mod table;
mod threads;
