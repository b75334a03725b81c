//! Options of `backdrive prove`.

use super::values::{choices, patience, positive};
use backdrive_prove::{Nominal, Operator};
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive prove --seed 1 --out proof
  backdrive prove --cases 30 --same-grip --out proofs

The hidden plant is a separate program: `cargo build --release --workspace` builds backdrive-sealed into the same folder. The truth is sealed
first: its SHA-256 is printed before anything is recorded, and only that program opens it until the verdict is written. Of several cases,
every fifth conceals nothing, and in every second one the hand is not measured; its search may take 2.5 times as long. Each case has a
folder with sealed/, session/ (bags and set), diagnosis/ and logs; proof.json and proof.html cover all cases.
Exit code 0 if all effects were found by family and place without a false alarm, no canceller of the diagnosis is worse than none,
and every live run agrees with the stability limits.

Other exit codes: 1 if not, 2 usage, 3 a file is wrong, 5 a file cannot be written,
6 a node failed, 130 interrupted.";

/// `backdrive prove`
#[derive(Debug, Clone, Args)]
pub struct Prove {
    /// Seed of the concealed effects; further cases use the following numbers.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Number of effects concealed in one case.
    #[arg(long, default_value_t = 1, value_parser = at_most_three)]
    pub effects: usize,
    /// Number of cases.
    #[arg(long, default_value_t = 1, value_parser = some)]
    pub cases: usize,
    /// Conceal only effects that no linear model can reproduce.
    #[arg(long)]
    pub nonlinear: bool,
    /// Folder for the cases; an existing truth is not replaced.
    #[arg(long, value_name = "DIR", default_value = "proof")]
    pub out: PathBuf,
    /// The nominal master.
    #[arg(long, value_name = "FILE", default_value = "plant/models/impulse-engine-linear.toml")]
    pub model: PathBuf,
    /// The nominal grip.
    #[arg(long, value_name = "FILE", default_value = "plant/grips/normal.toml")]
    pub grip: PathBuf,
    /// The second-order model to fit for comparison.
    #[arg(long, value_name = "FILE", default_value = "plant/models/impulse-engine-second-order.toml")]
    pub second_order: PathBuf,
    /// The session to record: a graph with experiments.
    #[arg(long, value_name = "FILE", default_value = "launch/prove.toml")]
    pub session: PathBuf,
    /// The task for the search of the stability limit.
    #[arg(long, value_name = "FILE", default_value = "launch/contact.toml")]
    pub contact: PathBuf,
    /// The same task with a hand that changes its grip during contact.
    #[arg(long, value_name = "FILE", default_value = "launch/contact-regrip.toml")]
    pub regrip: PathBuf,
    /// Corner frequency of the high-pass of cancellers with a fixed hand, Hz.
    #[arg(long, value_name = "HZ", default_value_t = 1.0)]
    pub high_pass: f64,
    /// Search effort of a diagnosis, as a multiple of the default; 2.5 times as much if the hand was not measured.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.0)]
    pub effort: f64,
    /// Time limit for each diagnosis, s.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = patience())]
    pub patience: f64,
    /// Whether the bags contain the intent of the hand, which is not measured in a real session.
    #[arg(long, value_name = "WHICH", default_value = "half", value_parser = choices([
        ("shown", "None", Operator::Shown),
        ("hidden", "All", Operator::Hidden),
        ("half", "Every second one", Operator::Half),
    ]))]
    pub operator: Operator,
    /// Whether the nominal parameters were first refitted to a session, so that they absorb part of the concealed effects.
    #[arg(long, value_name = "WHICH", default_value = "half", value_parser = choices([
        ("given", "None: the random nominal errors remain", Nominal::Given),
        ("refitted", "All", Nominal::Refitted),
        ("half", "Two of every four", Nominal::Half),
    ]))]
    pub nominal: Nominal,
    /// Bandwidth of an unmeasured hand, Hz.
    #[arg(long, value_name = "HZ", value_parser = positive, default_value_t = 5.0)]
    pub hand_bandwidth: f64,
    /// Further grips for the stability limit: factors on the grip of the session.
    #[arg(long, value_name = "FACTORS", value_delimiter = ',', value_parser = positive, default_values_t = [0.5, 0.7, 1.4, 2.0])]
    pub grips: Vec<f64>,
    /// Use only the grip of the session, without a change of grip.
    #[arg(long, conflicts_with = "grips")]
    pub same_grip: bool,
    /// Search the limits in one process only, without live runs near them.
    #[arg(long)]
    pub no_live: bool,
    /// Only conceal, record and diagnose, without stability limits.
    #[arg(long, conflicts_with_all = ["grips", "same_grip"])]
    pub no_gains: bool,
    /// File for the report; without this proof.html in the folder of the cases.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// The program of the hidden plant; without this `backdrive-sealed` in the folder of this program, or on the path.
    #[arg(long, value_name = "FILE")]
    pub plant: Option<PathBuf>,
}

fn at_most_three(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n <= 3).ok_or_else(|| "must be a whole number from 0 to 3".to_string())
}

fn some(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| (1..=1000).contains(n)).ok_or_else(|| "must be a whole number from 1 to 1000".to_string())
}
