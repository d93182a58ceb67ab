//! Arguments of the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Collisions between deformable blocks.
///
/// Explicit finite elements in the blocks, contact without springs between
/// them. Start with `cdem new`, then run its scene with `cdem run`.
#[derive(Debug, Parser)]
#[command(
    name = "cdem",
    version,
    arg_required_else_help = true,
    max_term_width = 100
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Check a scene and run it
    #[command(after_help = EXIT_STATUS)]
    Run(RunArgs),
    /// Check a scene and print a summary, without a run
    Check {
        /// Scene file
        scene: PathBuf,
    },
    /// Resume an interrupted run from its last checkpoint
    #[command(after_help = EXIT_STATUS)]
    Resume(ResumeArgs),
    /// Write a scene with comments to start from, or list all of them
    New {
        /// Name of the template; left out: list all templates
        template: Option<String>,
        /// New folder for the scene; left out: the name of the template
        #[arg(value_name = "DIR")]
        folder: Option<PathBuf>,
    },
    /// Write report.html, a self-contained page about a run
    Report {
        /// Results folder
        #[arg(value_name = "DIR")]
        results: PathBuf,
    },
    /// Print the JSON Schema of scenes, for editors
    Schema,
}

#[derive(Args, Debug)]
pub(crate) struct RunArgs {
    /// Scene file
    pub(crate) scene: PathBuf,
    /// Results folder; left out: SCENE without its extension, with "-results"
    #[arg(short, long = "output", value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Number of threads; left out: `RAYON_NUM_THREADS`, else one for each processor
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// Replace an earlier run in the folder; other files are never replaced
    #[arg(long)]
    pub(crate) force: bool,
    /// Print the time of each stage at the end; makes steps of a few microseconds up to 25 % slower
    #[arg(long)]
    pub(crate) profile: bool,
}

#[derive(Args, Debug)]
pub(crate) struct ResumeArgs {
    /// Results folder
    #[arg(value_name = "DIR")]
    pub(crate) results: PathBuf,
    /// Number of threads; left out: `RAYON_NUM_THREADS`, else one for each processor
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// Print the time of each stage at the end; makes steps of a few microseconds up to 25 % slower
    #[arg(long)]
    pub(crate) profile: bool,
}

/// Parses a number of threads.
fn threads(text: &str) -> Result<u16, String> {
    let number = text.parse().ok().filter(|number| *number > 0);
    number.ok_or_else(|| format!("expected a whole number from 1 to {}", u16::MAX))
}

const EXIT_STATUS: &str = "\
Exit status:
  0    done
  2    error in the arguments or the scene; nothing was written
  3    the run stopped itself; its results up to then are complete
  130  interrupted (Ctrl-C); resume with `cdem resume DIR`, unless `output.checkpoint` is 0";

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
