//! The command `cdem-verify`: runs the problems of the book and updates the figures of its pages.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use cdem_verify::problem::Problem;
use cdem_verify::{page, problems, reference};
use clap::Parser;

/// Verification of cdem: problems with known answers, each with a page in the book.
#[derive(Parser)]
#[command(name = "cdem-verify", version)]
struct Arguments {
    /// Problems to run, as V1 V9; all, if none is named.
    problems: Vec<String>,
    /// Write figures and plots into the pages of the book, and the page of all keys.
    #[arg(long)]
    write: bool,
}

#[expect(clippy::print_stdout, clippy::print_stderr, reason = "it is a command")]
fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let chosen = match choose(&arguments.problems) {
        Ok(chosen) => chosen,
        Err(unknown) => {
            let known: Vec<&str> = problems::ALL.iter().map(|problem| problem.number).collect();
            eprintln!(
                "there is no problem {unknown}; choose from {}",
                known.join(", ")
            );
            return ExitCode::from(2);
        }
    };
    let (mut wrong, mut written) = (0, Vec::new());
    for problem in chosen {
        let began = Instant::now();
        let findings = (problem.solve)();
        println!(
            "{}, {} ({:.1} s)",
            problem.number,
            problem.page,
            began.elapsed().as_secs_f64()
        );
        for figure in &findings.figures {
            let verdict = if figure.holds() { "  " } else { "✗ " };
            println!("  {verdict}{figure}");
        }
        wrong += findings.wrong().len();
        if arguments.write && findings.wrong().is_empty() {
            written.push(page::files(problem, &findings));
        }
    }
    if arguments.write {
        written.push(Ok(vec![reference::file()]));
    }
    if let Err(mistake) = write(written) {
        eprintln!("{mistake}");
        return ExitCode::FAILURE;
    }
    if wrong > 0 {
        eprintln!("number of figures that miss their known value: {wrong}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// Returns the problems with these numbers, or the first number that is unknown.
fn choose(numbers: &[String]) -> Result<Vec<&'static Problem>, &str> {
    if numbers.is_empty() {
        return Ok(problems::ALL.iter().collect());
    }
    let named = |number: &String| {
        problems::ALL
            .iter()
            .find(|problem| problem.number.eq_ignore_ascii_case(number))
    };
    let found = numbers.iter().map(|n| named(n).ok_or(n.as_str()));
    found.collect()
}

/// Writes all pages after the last run, so that no page is left half updated.
fn write(files: Vec<Result<Vec<(PathBuf, String)>, String>>) -> Result<(), String> {
    for of_page in files {
        for (path, text) in of_page? {
            std::fs::write(&path, text)
                .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        }
    }
    Ok(())
}
