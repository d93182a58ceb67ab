//! The command as a user meets it: what it prints, writes and returns.

mod book;
mod cautions;
mod help;
mod place;
mod report;
mod resume;
mod run;
mod templates;
mod wrong;
