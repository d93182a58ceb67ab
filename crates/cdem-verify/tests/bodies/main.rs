//! Bodies and time integration: free flight, waves, order of convergence, time levels, prescribed
//! motion and loads, each against a closed form.

#![allow(clippy::print_stdout)] // the figures are the report

mod flight;
mod levels;
mod loads;
mod motion;
mod order;
mod shared;
