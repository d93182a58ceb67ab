//! A polygonal disc of many sides that rolls down a slope.

use cdem_verify::problem::Findings;
use cdem_verify::problems::rolling::{add_figures, disc, roll};

#[test]
#[ignore = "slow study: a disc of 96 sides"]
fn a_disc_of_many_sides_rolls_like_a_round_one() {
    let mut findings = Findings::default();
    add_figures(&mut findings, "disc of 96 sides", &roll(&disc(96), 96));
    println!("{:.5?}", findings.figures);
    assert!(findings.wrong().is_empty(), "{:?}", findings.wrong());
}
