//! Options of `backdrive stability`.

use super::changes::SwappedParts;
use super::values::{law, positive};
use backdrive_control::coupling::LawKind;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive run launch/push-and-hold.toml
  backdrive stability push-and-hold.mcap --gain 1
  backdrive stability push-and-hold.mcap --sweep 0.1:50:200 --html out/stability.html
  backdrive stability push-and-hold.mcap --gain 1 --canceller plant/models/impulse-engine.toml --canceller-grip plant/grips/normal.toml
  backdrive stability session/ --roles roles.toml --gain 1
  backdrive stability two-levers.csv --roles roles.toml

Exit codes: 0 stable, 1 not, 2 usage, 3 the bag or a file is wrong, 5 the report cannot be written, 7 not known, 130 interrupted.";

/// `backdrive stability`
#[derive(Debug, Args)]
pub struct Stability {
    /// The bag of a run; with --roles any MCAP file, a rosbag2 folder, or a table (CSV).
    pub recording: PathBuf,
    /// The loop gain mu*lambda to judge, set by lambda; without this that of the bag.
    #[arg(long, value_name = "X", value_parser = positive, allow_negative_numbers = true, conflicts_with_all = ["mu", "lambda"])]
    pub gain: Option<f64>,
    /// Position scale mu to judge; without this that of the bag.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub mu: Option<f64>,
    /// Force scale lambda to judge; without this that of the bag.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub lambda: Option<f64>,
    /// Compute the whole curve: gains FROM to TO, COUNT of them, evenly spaced on a logarithmic scale.
    #[arg(long, value_name = "FROM:TO:COUNT", value_parser = gains)]
    pub sweep: Option<Gains>,
    /// Factors on the stiffness and damping of the grip for which the answer is given.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = positive, default_values_t = GRIPS)]
    pub grips: Vec<f64>,
    /// A graph file whose operator is used instead of the recorded hand.
    #[arg(long, value_name = "GRAPH")]
    pub script: Option<PathBuf>,
    /// The roles of topics or columns, for a recording that backdrive did not make; see docs/roles-example.toml.
    #[arg(long, value_name = "FILE")]
    pub roles: Option<PathBuf>,
    /// Coupling law to judge, instead of the bag's scaling or coupling law; see docs/couplings.md.
    #[arg(long, value_name = "LAW", value_parser = law())]
    pub coupling: Option<LawKind>,
    /// Write the report as one HTML file.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub parts: SwappedParts,
}

/// Factors on stiffness and damping of the grip, where nothing else is asked.
pub const GRIPS: [f64; 5] = [0.7, 0.85, 1.0, 1.15, 1.3];

/// Gains of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Gains(pub Vec<f64>);

/// Most gains in a sweep.
const MOST_GAINS: usize = 100_000;

fn gains(text: &str) -> Result<Gains, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let [from, to, count] = parts.as_slice() else { return Err("must be FROM:TO:COUNT, such as 0.1:50:200".to_string()) };
    let (from, to) = (positive(from)?, positive(to)?);
    let count: usize = count.parse().map_err(|_| format!("COUNT must be 1 to {MOST_GAINS}"))?;
    spaced(from, to, count)
}

/// So many gains from one to another, evenly spaced in their logarithm.
///
/// # Errors
/// There are too many or none, or one of the two is no gain.
pub fn spaced(from: f64, to: f64, count: usize) -> Result<Gains, String> {
    if !(1..=MOST_GAINS).contains(&count) {
        return Err(format!("COUNT must be 1 to {MOST_GAINS}"));
    }
    if !(from.is_finite() && to.is_finite() && from > 0.0) {
        return Err("FROM and TO must be above 0".to_string());
    }
    if to < from {
        return Err("FROM must not be above TO".to_string());
    }
    let at = |i: usize| if count == 1 { from } else { from * (to / from).powf(i as f64 / (count - 1) as f64) };
    Ok(Gains((0..count).map(at).collect()))
}
