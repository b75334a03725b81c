//! Options of `backdrive init`: every question that it asks has one.

use super::values::{choices, positive};
use backdrive_sets::init::options::{Attached, Driven, Motion, Start};
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive init mine
  backdrive init mine --motion rotation --driven current --drive current --constant 0.035 --position encoder --per-count 1.5708e-3 --yes
  backdrive init rig --motion translation --driven motion --drive x --force load --attached spring --yes
  backdrive init log --columns 'angle [deg],speed [deg/s],torque [N m]' --rate 1000 --motion rotation --drive torque --position angle --yes
  backdrive diagnose mine --out mine/diagnosis

Writes model.toml and set.toml into the folder of the recordings and checks them as diagnose does. On a terminal it asks for missing options.
Otherwise a missing option is an error that names it; with --yes the default is used if there is one.
Columns are named by their headings, with or without unit; for bags by TOPIC.FIELD, such as /joint_states.position[0].
A heading states its unit in brackets, in parentheses or after a slash: q [deg], q (deg), q / deg. Without a unit, SI units are assumed and
reported; values that contradict them are refused.

Tables without a heading or times (--columns, --rate) and .npz, .npy, .mat and .parquet files are converted to bags in the folder bags/.

Exit codes: 0 written and checked; 2 usage; 3 a recording is wrong, a file exists, or diagnose would refuse what was written; 5 a file cannot be written.";

/// `backdrive init`
#[derive(Debug, Clone, Default, Args)]
pub struct Init {
    /// Folder of the recordings, and of the files that are written.
    #[arg(value_name = "FOLDER", default_value = ".")]
    pub folder: PathBuf,
    /// A recording (CSV, MCAP, NumPy, MATLAB or parquet); may be given several times. Without this all in the folder.
    #[arg(long, value_name = "FILE")]
    pub recording: Vec<PathBuf>,
    /// The held-out recording. Without this the one with medium excitation.
    #[arg(long, value_name = "FILE")]
    pub held_out: Option<PathBuf>,
    /// For tables without a heading: the names of the columns in order; a name may include a unit.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub columns: Vec<String>,
    /// For tables without a time column: rows per second.
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Whether it translates or rotates.
    #[arg(long, value_parser = choices([("translation", "Translation: m, kg, N", Motion::Translation), ("rotation", "Rotation: rad, kg m², N m", Motion::Rotation)]))]
    pub motion: Option<Motion>,
    /// What is prescribed and recorded: a force (a torque), a motor's current, or a motion whose reaction force is measured.
    #[arg(long, value_parser = choices([
        ("force|torque", "A force or a torque", Driven::Force),
        ("current", "A motor's current", Driven::Current),
        ("motion", "A prescribed motion", Driven::Motion),
    ]))]
    pub driven: Option<Driven>,
    /// The column of this input.
    #[arg(long, value_name = "COLUMN")]
    pub drive: Option<String>,
    /// Its unit, if the heading states none.
    #[arg(long, value_name = "UNIT")]
    pub drive_unit: Option<String>,
    /// The motor constant including the gear ratio, N/A or N m/A.
    #[arg(long, value_name = "NUMBER", value_parser = positive, allow_negative_numbers = true)]
    pub constant: Option<f64>,
    /// The column of the time; without this t or time.
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Its unit, if the heading states none: s, ms, us, ns, min.
    #[arg(long, value_name = "UNIT")]
    pub time_unit: Option<String>,
    /// The column of a measured position or angle; `none` if there is none.
    #[arg(long, value_name = "COLUMN|none")]
    pub position: Option<String>,
    /// Its unit, if the heading states none.
    #[arg(long, value_name = "UNIT")]
    pub position_unit: Option<String>,
    /// Size of one count, m or rad, if the position (or, without --position, the prescribed motion) is in counts.
    #[arg(long, value_name = "NUMBER", value_parser = positive, allow_negative_numbers = true)]
    pub per_count: Option<f64>,
    /// Resolution of the position encoder, m or rad; without this estimated from the samples.
    #[arg(long, value_name = "NUMBER", value_parser = positive, allow_negative_numbers = true)]
    pub resolution: Option<f64>,
    /// The column of a measured velocity; `none` if there is none.
    #[arg(long, value_name = "COLUMN|none")]
    pub velocity: Option<String>,
    /// Its unit, if the heading states none.
    #[arg(long, value_name = "UNIT")]
    pub velocity_unit: Option<String>,
    /// The column of a measured force (or torque): the reaction of a prescribed motion, or the force in the joint to a load; `none` if there is none.
    #[arg(long, value_name = "COLUMN|none")]
    pub force: Option<String>,
    /// Its unit, if the heading states none.
    #[arg(long, value_name = "UNIT")]
    pub force_unit: Option<String>,
    /// What is attached to the driven body: nothing, a spring to the frame (a specimen, a return spring), or a load behind a compliant joint.
    #[arg(long, value_parser = choices([
        ("nothing", "Nothing but its own mass and bearing", Attached::Nothing),
        ("spring", "A spring to the frame", Attached::Spring),
        ("load", "A second body behind a compliant joint", Attached::Load),
    ]))]
    pub attached: Option<Attached>,
    /// Approximate resonance of the load against the motor, Hz.
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    pub resonance: Option<f64>,
    /// A hand whose motion was not measured holds the device: its motion is estimated as a slow curve.
    #[arg(long, num_args = 0..=1, default_missing_value = "yes", value_parser = choices([("yes", "Yes", true), ("no", "No", false)]))]
    pub hand: Option<bool>,
    /// The moving mass, kg, or inertia, kg m^2; without this an estimate from the recordings.
    #[arg(long, value_name = "NUMBER", value_parser = positive, allow_negative_numbers = true)]
    pub inertia: Option<f64>,
    /// Initial state of each recording. Without this it is estimated from the samples.
    #[arg(long, value_parser = choices([("rest", "At rest at the first sample", Start::Rest), ("free", "In any state", Start::Free)]))]
    pub start: Option<Start>,
    /// Use the default for every question that no option answers.
    #[arg(long)]
    pub yes: bool,
    /// Replace model.toml and set.toml if they exist.
    #[arg(long)]
    pub overwrite: bool,
    /// Print what was written and found as JSON.
    #[arg(long)]
    pub json: bool,
}
