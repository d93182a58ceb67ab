//! Arguments of the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Collisions between deformable blocks.
///
/// Explicit finite elements inside the blocks, spring-free contact between
/// them. Start with `cdem new`, then `cdem run` the scene it writes.
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
    /// Check a scene and sum it up without running it
    Check {
        /// The scene
        scene: PathBuf,
    },
    /// Go on with an interrupted run from its last checkpoint
    #[command(after_help = EXIT_STATUS)]
    Resume(ResumeArgs),
    /// Write a commented scene to start from, or list those there are
    New {
        /// Name of the template; left out: list them
        template: Option<String>,
        /// Folder to write; left out: the name of the template
        #[arg(value_name = "DIR")]
        folder: Option<PathBuf>,
    },
    /// Write report.html, one self-contained page on a run
    Report {
        /// Folder of the results
        #[arg(value_name = "DIR")]
        results: PathBuf,
    },
    /// Print the JSON Schema of scenes, for editors
    Schema,
}

#[derive(Args, Debug)]
pub(crate) struct RunArgs {
    /// The scene
    pub(crate) scene: PathBuf,
    /// Folder of the results; left out: SCENE without its ending, with "-results"
    #[arg(short, long = "output", value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Threads; left out: `RAYON_NUM_THREADS`, or else one for each processor
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// Replace an earlier run in the folder, never anything else
    #[arg(long)]
    pub(crate) force: bool,
    /// Say at the end where the time went; steps of a few microseconds take up to a quarter longer
    #[arg(long)]
    pub(crate) profile: bool,
}

#[derive(Args, Debug)]
pub(crate) struct ResumeArgs {
    /// Folder of the results
    #[arg(value_name = "DIR")]
    pub(crate) results: PathBuf,
    /// Threads; left out: `RAYON_NUM_THREADS`, or else one for each processor
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// Say at the end where the time went; steps of a few microseconds take up to a quarter longer
    #[arg(long)]
    pub(crate) profile: bool,
}

/// Parses a number of threads.
fn threads(text: &str) -> Result<u16, String> {
    let number = text.parse().ok().filter(|number| *number > 0);
    number.ok_or_else(|| format!("a whole number from 1 to {} is needed", u16::MAX))
}

const EXIT_STATUS: &str = "\
Exit status:
  0    done
  2    the call or the scene is wrong; nothing was written
  3    the run stopped itself; the results up to there are whole
  130  interrupted (Ctrl-C); `cdem resume DIR` goes on, unless `output.checkpoint` is 0";

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
