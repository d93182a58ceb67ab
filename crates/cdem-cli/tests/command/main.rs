//! The command as a user sees it: its output, files and exit status.

mod book;
mod cautions;
mod help;
mod place;
mod report;
mod resume;
mod run;
mod templates;
mod wrong;
