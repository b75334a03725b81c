//! Options of `backdrive export`.

use super::values::{choices, positive};
use backdrive_export::feedforward::Language;
use backdrive_export::target::Target;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive export out/diagnosis/model.diagnosed.toml --to mjcf --out device.xml
  backdrive export arm.toml --to urdf --on set/ --out arm.urdf
  backdrive export plant/models/impulse-engine.toml --to feedforward --language python

Parts that the target format cannot represent are listed on standard error (with --out on standard output), each with its replacement and,
with --on, the error on held-out recordings with and without it.

Exit codes: 0 exported completely, 1 exported without the listed parts, 2 usage, 3 the model or a recording is wrong, or there is nothing to export,
5 a file cannot be written.";

/// `backdrive export`
#[derive(Debug, Args)]
pub struct Export {
    /// The model file: a network of one axis, or a model with a [robot].
    pub model: PathBuf,
    /// The target format.
    #[arg(long, value_parser = choices([
        (Target::Mjcf.word(), "MuJoCo 4.0", Target::Mjcf),
        (Target::Urdf.word(), "Joints of a robot: dynamics and limits", Target::Urdf),
        (Target::Isaac.word(), "Joints of a robot for Isaac Lab 2.3 on Isaac Sim 5", Target::Isaac),
        (Target::Feedforward.word(), "Friction as a function of position, velocity and load, for a controller", Target::Feedforward),
    ]))]
    pub to: Target,
    /// For a feed-forward: the programming language.
    #[arg(long, default_value = "c", value_parser = choices([
        ("c", "C99", Language::C),
        ("python", "Python 3", Language::Python),
        ("yaml", "Numbers and equations", Language::Yaml),
    ]))]
    pub language: Language,
    /// For a feed-forward: width w of the smooth sign tanh(v/w), m/s or rad/s. Without this 1 mm/s or 10 mrad/s, or less if friction falls faster.
    #[arg(long, value_name = "W", value_parser = positive, allow_negative_numbers = true)]
    pub width: Option<f64>,
    /// For an MJCF: its time step, s; without this a step that suits the model.
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    pub step: Option<f64>,
    /// Recordings (a set, a folder, or files) to compute the error that omitted parts cause; held-out ones if there are any.
    #[arg(long, value_name = "SET", num_args = 1..)]
    pub on: Vec<PathBuf>,
    /// A recorded input that the model may lack; may be given several times.
    #[arg(long, value_name = "NAME", requires = "on")]
    pub ignore_signal: Vec<String>,
    /// Output file; without this standard output.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace a file that exists.
    #[arg(long)]
    pub overwrite: bool,
    /// Print what was exported and omitted as JSON.
    #[arg(long)]
    pub json: bool,
}
