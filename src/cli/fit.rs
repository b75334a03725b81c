//! Options of `backdrive fit`.

use super::values::{patience, positive};
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive fit model.toml set/ --out model.fitted.toml
  backdrive fit model.toml sweep.csv steps.csv --json

Exit codes: 0 fitted, 1 the records disagree: the model structure is wrong; 2 usage; 3 a recording or the model is wrong;
5 the model cannot be written; 130 interrupted.";

/// `backdrive fit`
#[derive(Debug, Args)]
pub struct Fit {
    /// The model file.
    pub model: PathBuf,
    /// A folder with set.toml, a set.toml, a folder of recordings, or recordings (CSV or MCAP).
    #[arg(required = true, value_name = "SET")]
    pub set: Vec<PathBuf>,
    /// The grip that holds the model, if the model contains no hand; `none` for no hand.
    #[arg(long, value_name = "FILE|none")]
    pub grip: Option<PathBuf>,
    /// A recorded input that the model may lack, such as a hand at rest; may be given several times. In set.toml:
    /// ignore = ["NAME"].
    #[arg(long, value_name = "NAME")]
    pub ignore_signal: Vec<String>,
    /// Write the refitted model, with nominal values and intervals in comments. Parameters that the recordings do not determine keep
    /// their nominal values.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Allow --out to replace the input model.
    #[arg(long)]
    pub overwrite: bool,
    /// Largest computation effort, as a multiple of the default.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.0, allow_negative_numbers = true)]
    pub effort: f64,
    /// Time limit, s. A result that it cuts short may depend on the machine.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = patience(), allow_negative_numbers = true)]
    pub patience: f64,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
