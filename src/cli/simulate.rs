//! Options of `backdrive simulate`.

use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive simulate plant/models/impulse-engine.toml sweep:amplitude=2,from=1,to=200,duration=10 --out sweep.csv
  backdrive simulate model.toml recording.csv --out predicted.csv

Exit codes: 0 simulated, 2 usage, 3 a file is wrong, 5 the prediction cannot be written.";

/// `backdrive simulate`
#[derive(Debug, Args)]
pub struct Simulate {
    /// The model file.
    pub model: PathBuf,
    /// A recording (CSV or bag), a folder with a set.toml, an excitation file, or an excitation such as `steps:amplitude=1,duration=2`.
    pub drive: String,
    /// Replace files that exist.
    #[arg(long)]
    pub overwrite: bool,
    /// File for the prediction (CSV); for a set a folder.
    #[arg(long, visible_alias = "csv", value_name = "FILE")]
    pub out: PathBuf,
    /// Grip or environment to attach at the model's user's body.
    #[arg(long, value_name = "FILE")]
    pub grip: Option<PathBuf>,
    /// Which input an excitation drives; the first one if not given.
    #[arg(long)]
    pub input: Option<String>,
    /// Samples per second of an excitation.
    #[arg(long, value_name = "HZ", default_value_t = 5000.0)]
    pub rate: f64,
    /// Substeps per sample; chosen from the model if not given.
    #[arg(long)]
    pub substeps: Option<usize>,
    /// Add the sensors' noise and quantisation, with this seed.
    #[arg(long, value_name = "SEED")]
    pub noise: Option<u64>,
    /// A set.toml whose `[columns]` map column names to the model's signals.
    #[arg(long, value_name = "SET.TOML")]
    pub columns: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
