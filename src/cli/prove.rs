//! Options of `backdrive prove`.

use super::values::{choices, patience, positive};
use backdrive_prove::{Nominal, Operator};
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive prove --seed 1 --out proof
  backdrive prove --cases 30 --same-grip --out proofs

The hidden plant is a program of its own: `cargo build --release --workspace` puts backdrive-sealed beside this one. The truth is sealed
first: its SHA-256 is printed before anything is recorded, and only that program opens it until the verdict is written. Of several cases
every fifth conceals nothing, and in every second one nobody measures the hand; its search may take 2.5 times as long. Each case has a
folder: sealed/, session/ (bags and set), diagnosis/, and logs; proof.json and proof.html are about all of them.
Exit code 0 when all was found by family and place and nothing where nothing was, no canceller of the diagnosis is worse than none with any
hand, and every live run did what the stability limits say; 1 when not, 2 usage, 3 a file is wrong, 5 a file cannot be written,
6 a node failed, 130 interrupted.";

/// `backdrive prove`
#[derive(Debug, Clone, Args)]
pub struct Prove {
    /// What is concealed is drawn from this; further cases from the numbers after it.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Effects concealed at once.
    #[arg(long, default_value_t = 1, value_parser = at_most_three)]
    pub effects: usize,
    /// How many cases.
    #[arg(long, default_value_t = 1, value_parser = some)]
    pub cases: usize,
    /// Conceal only what no linear model can imitate.
    #[arg(long)]
    pub nonlinear: bool,
    /// Folder for the cases; a truth that is there already is not drawn anew.
    #[arg(long, value_name = "DIR", default_value = "proof")]
    pub out: PathBuf,
    /// The nominal master.
    #[arg(long, value_name = "FILE", default_value = "plant/models/impulse-engine-linear.toml")]
    pub model: PathBuf,
    /// The nominal grip.
    #[arg(long, value_name = "FILE", default_value = "plant/grips/normal.toml")]
    pub grip: PathBuf,
    /// The shape of the second-order model that is fitted for comparison.
    #[arg(long, value_name = "FILE", default_value = "plant/models/impulse-engine-second-order.toml")]
    pub second_order: PathBuf,
    /// The session that is recorded, a graph with experiments.
    #[arg(long, value_name = "FILE", default_value = "launch/prove.toml")]
    pub session: PathBuf,
    /// The task in which the gain is raised.
    #[arg(long, value_name = "FILE", default_value = "launch/contact.toml")]
    pub contact: PathBuf,
    /// The same task with a hand that changes its grip while it pushes.
    #[arg(long, value_name = "FILE", default_value = "launch/contact-regrip.toml")]
    pub regrip: PathBuf,
    /// Corner of the high-pass of the cancellers that do not estimate the hand, while the gain is raised, Hz.
    #[arg(long, value_name = "HZ", default_value_t = 1.0)]
    pub high_pass: f64,
    /// How much a diagnosis searches, as a multiple of the default; two and a half times that where nobody measured the hand.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.0)]
    pub effort: f64,
    /// A limit on the clock for each diagnosis.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = patience())]
    pub patience: f64,
    /// Whether the bags hold what the hand wants: in a real session nobody measures it.
    #[arg(long, value_name = "WHICH", default_value = "half", value_parser = choices([
        ("shown", "None", Operator::Shown),
        ("hidden", "All", Operator::Hidden),
        ("half", "Every second one", Operator::Half),
    ]))]
    pub operator: Operator,
    /// Whether the nominal numbers were refitted to a session before: they have then taken on what they can of what is concealed.
    #[arg(long, value_name = "WHICH", default_value = "half", value_parser = choices([
        ("given", "None: its numbers are off as they were drawn", Nominal::Given),
        ("refitted", "All", Nominal::Refitted),
        ("half", "Two of every four", Nominal::Half),
    ]))]
    pub nominal: Nominal,
    /// Hz, up to which a hand moves that nobody measured.
    #[arg(long, value_name = "HZ", value_parser = positive, default_value_t = 5.0)]
    pub hand_bandwidth: f64,
    /// How firmly the hand grips in further runs at each gain: factors on the grip of the session.
    #[arg(long, value_name = "FACTORS", value_delimiter = ',', value_parser = positive, default_values_t = [0.5, 0.7, 1.4, 2.0])]
    pub grips: Vec<f64>,
    /// Only the grip of the session, and no hand that changes it.
    #[arg(long, conflicts_with = "grips")]
    pub same_grip: bool,
    /// Raise the gain in one process only: the graph itself is not run about the edges.
    #[arg(long)]
    pub no_live: bool,
    /// Only conceal, record and diagnose: no gain is raised.
    #[arg(long, conflicts_with_all = ["grips", "same_grip"])]
    pub no_gains: bool,
    /// Where the report goes; without this proof.html in the folder of the cases.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// The program of the hidden plant; without this `backdrive-sealed` beside this program, or on the path.
    #[arg(long, value_name = "FILE")]
    pub plant: Option<PathBuf>,
}

fn at_most_three(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n <= 3).ok_or_else(|| "must be a whole number from 0 to 3".to_string())
}

fn some(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| (1..=1000).contains(n)).ok_or_else(|| "must be a whole number from 1 to 1000".to_string())
}
