//! Options of `backdrive diagnose`.

use super::values::positive;
use backdrive_answers::checks::effect;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive run launch/identify.toml --out out/identify
  backdrive diagnose out/identify --model plant/models/impulse-engine-linear.toml --grip plant/grips/normal.toml --out out/diagnosis
  backdrive diagnose session.csv held-out.csv --model model.toml --out out/diagnosis --effort 3 --explain
  backdrive diagnose set/ --without coulomb --out out/diagnosis
  backdrive diagnose studies/dfki_double_pendulum/set-arm.toml --out out/arm      (a model with [robot]: logs of every joint, docs/arms.md)
  backdrive diagnose episodes/ --model arm.toml --out out/servo      (commands and positions without torque, docs/servo.md)

Writes verdict.json, model.diagnosed.toml, report.html and time.txt. Ctrl-C ends the search and writes what was found until then.

Exit codes: 0 nothing is missing (numbers may be off), 1 something is missing, unexplained or ambiguous, 2 usage,
3 a recording or the model is wrong, 5 a file cannot be written, 7 it cannot be told, 130 interrupted.";

/// `backdrive diagnose`
#[derive(Debug, Args)]
pub struct Diagnose {
    /// A folder with set.toml, a set.toml, a folder of recordings, or recordings (CSV or MCAP). Without a set.toml the last one is held out.
    #[arg(required = true, value_name = "SET")]
    pub set: Vec<PathBuf>,
    /// Folder for verdict.json, model.diagnosed.toml and report.html; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The nominal model; without this the set's own.
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// The grip that holds the nominal model, where it holds no hand itself; `none` for no hand.
    #[arg(long, value_name = "FILE|none")]
    pub grip: Option<PathBuf>,
    /// A recorded signal that is not used: an input that has no place in the model, such as a hand that was at rest, or an output that is not
    /// compared; may be given several times. In set.toml: ignore = ["NAME"].
    #[arg(long, value_name = "NAME")]
    pub ignore_signal: Vec<String>,
    /// A physics that is not to be considered, and with it all that contain it as a special case; may be given several times.
    #[arg(long, value_name = "KIND", value_parser = effect)]
    pub without: Vec<String>,
    /// How many physics may be missing at once, at most; more take more time. Without this 3, of an arm 8
    /// beside constant, dry and viscous friction and armature, of servo joints any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8))]
    pub effects: Option<u8>,
    /// How much to search, as a multiple of the default (1), which takes up to about 20 s on two cores. The verdict depends on this alone, and is the same
    /// on every machine. For an arm and servo joints it has no effect: everything is tried.
    #[arg(long, value_name = "FACTOR", value_parser = positive, allow_negative_numbers = true)]
    pub effort: Option<f64>,
    /// A limit on the clock; without this 600 s, and none for an arm and for servo joints. Where it cuts the search off, the verdict may depend on the
    /// machine, and says so.
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    pub patience: Option<f64>,
    /// Print what the search tried, what it cost and why it lost.
    #[arg(long, conflicts_with = "json")]
    pub explain: bool,
    /// Print the verdict as JSON.
    #[arg(long)]
    pub json: bool,
    /// Where the report goes; without this report.html in the folder of --out.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Write no report.
    #[arg(long, conflicts_with = "html")]
    pub no_report: bool,
}
