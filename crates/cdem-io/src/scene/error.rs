//! Errors of a scene file, shown at their place in the text.

use std::fmt::{self, Write};
use std::io;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use cdem::scene::Problem;
use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, NamedSource, SourceSpan};
use thiserror::Error;

use super::source;

/// Error of a scene file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read the scene {}: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        reason: io::Error,
    },
    /// The file has errors.
    #[error("{}", list(.0))]
    Invalid(Vec<SceneProblem>),
    /// The scene of a program has errors; there is no text to show them in.
    #[error("{}", .0.iter().map(line).collect::<Vec<_>>().join("\n"))]
    Unwritten(Vec<Problem>),
}

/// An error in a scene, with its place in the text.
#[derive(Clone, Debug, Error, Diagnostic)]
#[error("{problem}")]
pub struct SceneProblem {
    /// Path, message and help.
    pub problem: Problem,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    #[source_code]
    text: Arc<NamedSource<String>>,
    #[label]
    span: SourceSpan,
    #[help]
    help: Option<String>,
}

/// The text of a scene and its name in messages.
#[derive(Clone, Debug)]
pub(super) struct Source(Arc<NamedSource<String>>);

impl Source {
    pub(super) fn new(name: &str, text: &str) -> Self {
        Self(Arc::new(NamedSource::new(name, text.to_owned())))
    }

    fn text(&self) -> &str {
        self.0.inner()
    }

    /// Creates the error with all problems and their places, in the order of the text.
    pub(super) fn invalid(&self, problems: Vec<Problem>) -> SceneError {
        let located = problems.into_iter().map(|problem| self.located(problem));
        let mut located: Vec<_> = located.collect();
        located.sort_by_key(|problem| problem.span.offset());
        SceneError::Invalid(located)
    }

    /// Returns one line for a problem, with its place.
    pub(super) fn line(&self, problem: &Problem) -> String {
        list(&[self.located(problem.clone())])
    }

    fn located(&self, problem: Problem) -> SceneProblem {
        let span = source::locate(self.text(), &problem.path, problem.place);
        self.at(problem, span)
    }

    /// Returns a problem at known bytes.
    pub(super) fn at(&self, problem: Problem, span: Range<usize>) -> SceneProblem {
        let (line, column) = source::line_and_column(self.text(), span.start);
        SceneProblem {
            help: problem.help.as_ref().map(|help| help.in_file.clone()),
            problem,
            line,
            column,
            text: Arc::clone(&self.0),
            span: span.into(),
        }
    }
}

impl SceneProblem {
    /// Returns the name of the scene file.
    #[must_use]
    pub fn file(&self) -> &str {
        self.text.name()
    }
}

/// Returns a line for a problem without a file: key, problem, advice.
pub(super) fn line(problem: &Problem) -> String {
    let help = problem.help.as_ref();
    let help = help.map(|help| format!(" ({})", help.in_program));
    format!("{problem}{}", help.unwrap_or_default())
}

/// Returns a line for each problem: file, line, column, problem, advice.
fn list(problems: &[SceneProblem]) -> String {
    let lines = problems.iter().map(|found| {
        let help = found.help.as_ref().map(|help| format!(" ({help})"));
        let (file, line, column) = (found.file(), found.line, found.column);
        format!(
            "{file}:{line}:{column}: {found}{}",
            help.unwrap_or_default()
        )
    });
    lines.collect::<Vec<_>>().join("\n")
}

impl SceneError {
    /// Returns the error for a terminal: each problem with its line of the scene and advice.
    /// Without `colours`, plain ASCII.
    #[must_use]
    pub fn render(&self, colours: bool) -> String {
        let Self::Invalid(problems) = self else {
            return format!("{self}\n");
        };
        let theme = if colours {
            GraphicalTheme::unicode()
        } else {
            GraphicalTheme::none()
        };
        let handler = GraphicalReportHandler::new_themed(theme).with_width(100);
        let mut text = String::new();
        for (i, problem) in problems.iter().enumerate() {
            if i > 0 {
                text.push('\n');
            }
            // Writing into a string fails only if a span is outside its text.
            if handler.render_report(&mut text, problem).is_err() {
                let _: fmt::Result = writeln!(text, "{}", list(std::slice::from_ref(problem)));
            }
        }
        text
    }
}
