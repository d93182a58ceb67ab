//! Every page of the book with a problem: its figures are what is known of them, and those
//! that this code gives.

use cdem_verify::problems::ALL;
use cdem_verify::{page, reference};

/// Solves a problem, and compares its page with what is made of that.
fn check(number: &str) {
    let problem = ALL.iter().find(|problem| problem.number == number);
    let problem = problem.expect("a problem of this number");
    let findings = (problem.solve)();
    let wrong = findings.wrong();
    let wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    assert!(wrong.is_empty(), "{number}: {}", wrong.join("; "));
    // Bits agree between threads and runs, not between kinds of processors.
    if cfg!(target_arch = "x86_64") {
        for (path, text) in page::files(problem, &findings).expect("a page") {
            let committed = std::fs::read_to_string(&path).unwrap_or_default();
            assert!(
                committed == text,
                "{} is not what this code gives: \
                 cargo run --release -p cdem-verify -- {number} --write",
                path.display()
            );
        }
    }
}

#[test]
fn v1_a_bar_meets_a_wall() {
    check("V1");
}

#[test]
fn v2_two_bars_meet() {
    check("V2");
}

#[test]
fn v3_unequal_bars_meet() {
    check("V3");
}

#[test]
fn v4_energy_of_bars_adds_up() {
    check("V4");
}

#[test]
fn v5_single_waves_disperse() {
    check("V5");
}

#[test]
fn v6_pulses_run_in_steel() {
    check("V6");
}

#[test]
fn v9_a_ball_meets_a_wall() {
    check("V9");
}

#[test]
fn v10_a_ball_meets_a_wall_askew() {
    check("V10");
}

#[test]
fn v11_pressed_blocks_pass_the_patch_test() {
    check("V11");
}

#[test]
fn v12_a_block_slides_down_a_slope() {
    check("V12");
}

#[test]
fn v13_blocks_stay_slide_and_topple() {
    check("V13");
}

#[test]
fn v15_discs_roll() {
    check("V15");
}

#[test]
fn v16_a_block_rocks() {
    check("V16");
}

#[test]
fn v17_a_block_bounces() {
    check("V17");
}

#[test]
fn v18_a_cradle_hands_on() {
    check("V18");
}

#[test]
fn v19_a_pressed_bar_turns() {
    check("V19");
}

#[test]
fn the_page_of_keys_is_that_of_the_schema() {
    let (path, text) = reference::file();
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == text,
        "cargo run --release -p cdem-verify -- --write"
    );
}

#[test]
fn every_problem_is_tested_here() {
    assert_eq!(ALL.len(), 16);
}
