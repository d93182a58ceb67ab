//! The problems of the book: their figures agree with the known values, and the pages agree with
//! the code.

use cdem_verify::problems::ALL;
use cdem_verify::{page, reference};

/// Solves a problem and compares its page with the generated one.
fn check(number: &str) {
    let problem = ALL.iter().find(|problem| problem.number == number);
    let problem = problem.expect("a problem of this number");
    let findings = (problem.solve)();
    let wrong = findings.wrong();
    let wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    assert!(wrong.is_empty(), "{number}: {}", wrong.join("; "));
    // Bits agree between threads and runs, but not between processor architectures.
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

/// Defines a test for each problem, and a test that none is missing.
macro_rules! problems {
    ($($(#[$mark:meta])* $name:ident: $number:literal,)*) => {
        $(
            #[test]
            $(#[$mark])*
            fn $name() {
                check($number);
            }
        )*

        #[test]
        fn every_problem_is_tested_here() {
            let known: Vec<&str> = ALL.iter().map(|problem| problem.number).collect();
            assert_eq!(known, [$($number),*]);
        }
    };
}

problems! {
    a_bar_meets_a_wall: "V1",
    two_bars_meet: "V2",
    unequal_bars_meet: "V3",
    energy_of_bars_adds_up: "V4",
    single_waves_disperse: "V5",
    pulses_run_in_steel: "V6",
    a_ball_meets_a_wall: "V9",
    #[ignore = "slow study: many angles"]
    a_ball_meets_a_wall_askew: "V10",
    pressed_blocks_pass_the_patch_test: "V11",
    a_block_slides_down_a_slope: "V12",
    blocks_stay_slide_and_topple: "V13",
    discs_roll: "V15",
    a_block_rocks: "V16",
    a_block_bounces: "V17",
    a_cradle_hands_on: "V18",
    #[ignore = "slow study: a whole turn"]
    a_pressed_bar_turns: "V19",
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
