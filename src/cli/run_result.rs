//! What is made of a run, whether it is a first one or a replay.

use clap::Args;
use std::path::PathBuf;

/// Output of a run's result.
#[derive(Debug, Args)]
pub struct RunResult {
    /// Write a page about the run as one HTML file: result, signals, contact, timing, losses, events.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
