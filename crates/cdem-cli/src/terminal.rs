//! Output to stdout and stderr, with or without colours.

use std::fmt::{Arguments, Display};
use std::io::{ErrorKind, IsTerminal as _, Write as _};
use std::sync::OnceLock;

use cdem_io::scene::SceneError;
use console::Style;

use crate::failure::{Cause, Failure};

/// Decides on colours once: on if there is a terminal and NO_COLOR is unset.
pub(crate) fn prepare() {
    let wanted = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    console::set_colors_enabled(wanted && std::io::stdout().is_terminal());
    console::set_colors_enabled_stderr(wanted && std::io::stderr().is_terminal());
}

/// Reason for which output could not be printed.
static LOST: OnceLock<String> = OnceLock::new();

/// Prints a line of the requested output on stdout. A closed reader is not an error.
pub(crate) fn print(line: impl Display) {
    let mut out = std::io::stdout();
    if let Err(error) = writeln!(out, "{line}").and_then(|()| out.flush())
        && error.kind() != ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.to_string());
    }
}

/// Returns the reason if some of the output could not be printed.
pub(crate) fn lost() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// Prints a line on stderr, for progress and messages.
pub(crate) fn say(line: Arguments<'_>) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints an error on stderr.
pub(crate) fn complain(failure: &Failure) {
    match &failure.cause {
        Cause::Scene(error @ SceneError::Unreadable { .. }) => {
            labelled("error:", Style::new().red(), &error.to_string());
        }
        Cause::Scene(error) => {
            let text = error.render(console::colors_enabled_stderr());
            say(format_args!("{}", text.trim_end()));
        }
        Cause::Message(message) => {
            labelled("error:", Style::new().red(), &message.problem);
            if !message.help.is_empty() {
                labelled(" help:", Style::new().cyan(), &message.help);
            }
        }
    }
}

/// Prints a warning on stderr.
pub(crate) fn warn(warning: &str) {
    labelled("warning:", Style::new().yellow(), warning);
}

fn labelled(label: &str, style: Style, text: &str) {
    let label = style.for_stderr().bold().apply_to(label);
    say(format_args!("{label} {text}"));
}

/// Makes text bold on stdout.
pub(crate) fn strong(text: &str) -> impl Display {
    Style::new().bold().apply_to(text.to_owned())
}
