//! Pages of the book: the part of each page that a run of its problem generates.

use std::path::{Path, PathBuf};

use crate::problem::{Findings, Problem};

const BEGIN: &str = "<!-- begin of figures: cargo run --release -p cdem-verify -- --write -->";
const END: &str = "<!-- end of figures -->";

/// Returns the generated part of a page, with its marks.
fn made(problem: &Problem, findings: &Findings) -> String {
    let mut text = format!(
        "{BEGIN}\n\n| Figure | Known value | Value of the run | Tolerance | Reason |\n\
         | --- | ---: | ---: | ---: | --- |\n"
    );
    for figure in &findings.figures {
        text.push_str(&format!(
            "| {} | {} | {} | {} | {} |\n",
            figure.what,
            figure.known.value(),
            figure.shown(),
            figure.known.tolerance(),
            figure.why
        ));
    }
    for (k, plot) in findings.plots.iter().enumerate() {
        let [across, up] = &plot.axes;
        text.push_str(&format!("\n![{up}; {across}]({})\n", picture(problem, k)));
    }
    text + "\n" + END
}

/// Returns the file name of a picture of a page.
fn picture(problem: &Problem, number: usize) -> String {
    format!("{}-{}.svg", problem.page, number + 1)
}

/// Returns the folder of the pages.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../book/src/verification")
}

/// Returns the files of a page with their generated parts updated.
///
/// # Errors
/// If the page does not exist or lacks the marks.
pub fn files(problem: &Problem, findings: &Findings) -> Result<Vec<(PathBuf, String)>, String> {
    let page = folder().join(problem.page).with_extension("md");
    let text = std::fs::read_to_string(&page)
        .map_err(|error| format!("cannot read {}: {error}", page.display()))?;
    let marks = || format!("{}: has no lines {BEGIN} and {END}", page.display());
    let (before, rest) = text.split_once(BEGIN).ok_or_else(marks)?;
    let (_, after) = rest.split_once(END).ok_or_else(marks)?;
    let text = format!("{before}{}{after}", made(problem, findings));
    let plots = findings.plots.iter().enumerate();
    let pictures = plots.map(|(k, plot)| (folder().join(picture(problem, k)), plot.draw()));
    Ok(std::iter::once((page, text)).chain(pictures).collect())
}
