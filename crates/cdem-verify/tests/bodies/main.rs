//! Bodies and time: free flight, waves, order of convergence, levels,
//! prescribed motion and loads, each against a closed form.

mod flight;
mod levels;
mod loads;
mod motion;
mod order;
mod shared;
mod waves;
