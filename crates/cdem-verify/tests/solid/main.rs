//! Contact in 3-D against exact answers. Run with `--nocapture` for the figures.

#![allow(clippy::print_stdout)] // the figures are the report

mod element;
mod flung;
mod flush;
mod joints;
mod meeting;
mod notch;
mod rest;
mod restitution;
mod ridges;
mod rocks;
mod shapes;
mod shoves;
mod slope;
mod threads;
mod ties;
mod tilt;
mod touch_time;
mod types;
mod variants;
mod wedge;
