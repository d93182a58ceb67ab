//! Contact against exact answers. Run with `--nocapture` for the figures.

#![allow(clippy::print_stdout)] // the figures are the report

mod bars;
mod bars_in_space;
mod corners;
mod crowd;
mod fine_ground;
mod fixed;
mod hertz;
mod in_line;
mod joints;
mod many;
mod paper;
mod patch;
mod pavement;
mod pressed;
mod rolling;
mod slope;
mod stack;
mod tunnel;
mod types;
