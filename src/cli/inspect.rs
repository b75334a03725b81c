//! Options of `backdrive inspect`.

use super::values::positive;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive inspect log.csv
  backdrive inspect session-1.csv session-2.csv --html out/inspect.html
  backdrive inspect recordings/ --json
  backdrive inspect log.csv --columns 'q1 (deg),q2 (deg),tau1,tau2' --rate 500

Several recordings of one device are also compared: a zero that differs between them is reported. Each finding states a correction; lines
such as [joints.elbow] are for the set.toml of `diagnose` (docs/own-recording.md, docs/arms.md).

Exit codes: 0 no problem, 1 a problem was found, 2 usage, 3 a recording cannot be read, 5 the page cannot be written.";

/// `backdrive inspect`
#[derive(Debug, Args)]
pub struct Inspect {
    /// Tables (CSV, parquet, MATLAB, NumPy), MCAP bags, LeRobot datasets, or folders of these.
    #[arg(required = true, value_name = "FILES")]
    pub files: Vec<PathBuf>,
    /// For a table without a heading: the names of its columns in order; a name may include a unit.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub columns: Vec<String>,
    /// For a table without a time column: rows per second.
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// The time column, if it is not found automatically.
    #[arg(long, value_name = "COLUMN", conflicts_with = "rate")]
    pub time: Option<String>,
    /// Write the answer as one HTML file that opens offline.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the answer as JSON.
    #[arg(long)]
    pub json: bool,
}
