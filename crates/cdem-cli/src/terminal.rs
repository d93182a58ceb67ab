//! The two streams, and whether they may have colours.

use std::fmt::{Arguments, Display};
use std::io::{ErrorKind, IsTerminal as _, Write as _};
use std::sync::OnceLock;

use cdem_io::scene::SceneError;
use console::Style;

use crate::failure::{Cause, Failure};

/// Decides on colours once: where there is a terminal and NO_COLOR is unset.
pub(crate) fn prepare() {
    let wanted = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    console::set_colors_enabled(wanted && std::io::stdout().is_terminal());
    console::set_colors_enabled_stderr(wanted && std::io::stderr().is_terminal());
}

/// Why something asked for could not be printed.
static LOST: OnceLock<String> = OnceLock::new();

/// A line on stdout: what was asked for. A reader that has gone is no error.
pub(crate) fn print(line: impl Display) {
    let mut out = std::io::stdout();
    if let Err(error) = writeln!(out, "{line}").and_then(|()| out.flush())
        && error.kind() != ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.to_string());
    }
}

/// Why not all that was asked for could be printed, if so.
pub(crate) fn lost() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// A line on stderr: what goes on.
pub(crate) fn say(line: Arguments<'_>) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// An error on stderr.
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

/// A warning on stderr.
pub(crate) fn warn(warning: &str) {
    labelled("warning:", Style::new().yellow(), warning);
}

fn labelled(label: &str, style: Style, text: &str) {
    let label = style.for_stderr().bold().apply_to(label);
    say(format_args!("{label} {text}"));
}

/// Text that stands out on stdout.
pub(crate) fn strong(text: &str) -> impl Display {
    Style::new().bold().apply_to(text.to_owned())
}
