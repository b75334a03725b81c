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

Writes verdict.json, model.diagnosed.toml, report.html and time.txt. Ctrl-C ends the search and writes the results so far.

Exit codes: 0 no effect is missing (parameters may be wrong), 1 an effect is missing, unexplained or ambiguous, 2 usage,
3 a recording or the model is wrong, 5 a file cannot be written, 7 not known, 130 interrupted.";

/// `backdrive diagnose`
#[derive(Debug, Args)]
pub struct Diagnose {
    /// A folder with set.toml, a set.toml, a folder of recordings, or recordings (CSV or MCAP). Without a set.toml the last one is held out.
    #[arg(required = true, value_name = "SET")]
    pub set: Vec<PathBuf>,
    /// Folder for verdict.json, model.diagnosed.toml and report.html; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The nominal model; without this the one that the set names.
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// The grip that holds the nominal model, if the model contains no hand; `none` for no hand.
    #[arg(long, value_name = "FILE|none")]
    pub grip: Option<PathBuf>,
    /// A recorded signal to ignore: an input that the model does not have, such as a hand at rest, or an output that is not
    /// compared; may be given several times. In set.toml: ignore = ["NAME"].
    #[arg(long, value_name = "NAME")]
    pub ignore_signal: Vec<String>,
    /// An effect to exclude, together with all that contain it as a special case; may be given several times.
    #[arg(long, value_name = "KIND", value_parser = effect)]
    pub without: Vec<String>,
    /// Largest number of missing effects; more take more time. Without this 3; for an arm 8
    /// in addition to constant torque, dry and viscous friction and armature; for servo joints any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8))]
    pub effects: Option<u8>,
    /// Search effort, as a multiple of the default (1), which takes up to about 20 s on two cores. The verdict depends only on this and is the same
    /// on every machine. For an arm or servo joints it has no effect: everything is tried.
    #[arg(long, value_name = "FACTOR", value_parser = positive, allow_negative_numbers = true)]
    pub effort: Option<f64>,
    /// Time limit, s; without this 600 s, and none for an arm or servo joints. If it ends the search, the verdict may depend on the machine and reports
    /// that.
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    pub patience: Option<f64>,
    /// Print all candidates of the search, their cost and why they were rejected.
    #[arg(long, conflicts_with = "json")]
    pub explain: bool,
    /// Print the verdict as JSON.
    #[arg(long)]
    pub json: bool,
    /// File for the report; without this report.html in the folder of --out.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Write no report.
    #[arg(long, conflicts_with = "html")]
    pub no_report: bool,
}
