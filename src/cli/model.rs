//! Options of `backdrive model`.

use clap::{Args, Subcommand};
use std::path::PathBuf;

/// `backdrive model`
#[derive(Debug, Subcommand)]
pub enum Model {
    /// Print the network, its modes and its frequency response.
    #[command(
        after_help = "Example:\n  backdrive model show plant/models/impulse-engine.toml --grip plant/grips/normal.toml\n\nExit codes: 0 shown, 2 usage, 3 a file is wrong or too large to show, 5 standard output cannot be written."
    )]
    Show(ModelFile),
    /// Check a model file; errors point at the line.
    #[command(
        after_help = "Example:\n  backdrive model check plant/models/impulse-engine.toml\n\nExit codes: 0 fine, 2 usage, 3 the file is wrong, or contains no moving body."
    )]
    Check(ModelFile),
}

/// A model file.
#[derive(Debug, Args)]
pub struct ModelFile {
    /// The model file, or a fragment.
    pub model: PathBuf,
    /// Grip or environment to attach at the model's user's body.
    #[arg(long, value_name = "FILE")]
    pub grip: Option<PathBuf>,
    /// Amplitude of motion for the linearisation of hysteresis, friction and backlash, m or rad; very small if not given.
    #[arg(long, value_name = "M")]
    pub amplitude: Option<f64>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
