//! What is made of a run, whether it is a first one or a replay.

use clap::Args;
use std::path::PathBuf;

/// How a run's result is given.
#[derive(Debug, Args)]
pub struct RunResult {
    /// Write a page about the run as one HTML file: what happened, signals, contact, timing, losses, events.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
