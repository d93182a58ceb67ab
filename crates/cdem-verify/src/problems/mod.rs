//! Problems with known answers. Each has a scene under `verification` and a page in the book;
//! [`solve`](Problem::solve) computes the figures of the page.

pub mod ball;
pub mod bars;
mod bounce;
pub mod hertz;
mod oblique;
pub mod patch;
mod rocking;
pub mod rolling;
mod rotation;
pub mod slope;
mod waves;

use crate::problem::{Findings, Problem};

const fn problem(number: &'static str, page: &'static str, solve: fn() -> Findings) -> Problem {
    Problem {
        number,
        page,
        solve,
    }
}

/// All problems, in the order of the book.
pub const ALL: [Problem; 16] = [
    problem("V1", "v01-bar-on-wall", bars::bar_on_wall),
    problem("V2", "v02-two-bars", bars::equal_bars),
    problem("V3", "v03-unequal-bars", bars::unequal_bars),
    problem("V4", "v04-energy-of-bars", bars::energy_of_bars),
    problem("V5", "v05-single-waves", waves::single_waves),
    problem("V6", "v06-pulses-in-steel", waves::pulses_in_steel),
    problem("V9", "v09-hertz", hertz::ball_on_wall),
    problem("V10", "v10-oblique-ball", oblique::oblique_ball),
    problem("V11", "v11-patch-test", patch::pressed_blocks),
    problem("V12", "v12-block-on-slope", slope::block_on_slope),
    problem("V13", "v13-slide-or-topple", slope::slide_or_topple),
    problem("V15", "v15-rolling", rolling::rolling_down),
    problem("V16", "v16-rocking", rocking::rocking_block),
    problem("V17", "v17-bouncing", bounce::bouncing_block),
    problem("V18", "v18-cradle", bars::cradle),
    problem(
        "V19",
        "v19-pressed-bar-turns",
        rotation::stressed_block_turns,
    ),
];
