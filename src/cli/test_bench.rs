//! Options of `backdrive test-bench`.

use super::values::positive;
use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Example:
  backdrive run launch/engine-test-bench-identify.toml --out out/bench --transport inproc
  backdrive test-bench out/bench/unfired.mcap out/bench/map.mcap out/bench/lag.mcap --dragged out/bench/unfired-other.mcap --cycle out/bench/validation.mcap \\
    --engine-inertia 0.9 --stiffness 2e4 --power 240e3 --out out/identified

Exit codes: 0 identified, 2 usage, 3 a bag lacks a needed signal, 5 the folder cannot be written.";

/// `backdrive test-bench`
#[derive(Debug, Args)]
pub struct TestBench {
    /// Bag of the bench with pedal 0, excited by the dynamometer.
    pub unfired: PathBuf,
    /// Bag of stationary points of pedal and speed.
    pub map: PathBuf,
    /// Bag of steps of the pedal at fixed speeds.
    pub lag: PathBuf,
    /// Bag of the bench dragged along other speeds, for validation; with --cycle.
    #[arg(long, value_name = "BAG", requires = "cycle")]
    pub dragged: Option<PathBuf>,
    /// Bag of a test cycle, for validation; with --dragged.
    #[arg(long, value_name = "BAG", requires = "dragged")]
    pub cycle: Option<PathBuf>,
    /// J_C of the data sheet (start value), kg m2.
    #[arg(long, value_name = "KG_M2", value_parser = positive, allow_negative_numbers = true)]
    pub engine_inertia: f64,
    /// Torsional stiffness of the data sheet (start value), N m/rad.
    #[arg(long, value_name = "NM_RAD", value_parser = positive, allow_negative_numbers = true)]
    pub stiffness: f64,
    /// Rated power of the dynamometer, W.
    #[arg(long, value_name = "W", value_parser = positive, allow_negative_numbers = true)]
    pub power: f64,
    /// Folder for engine.toml, dynamometer.toml and shaft.toml.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Shortest duration of constant pedal and speed that counts as stationary, s.
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 3.5, allow_negative_numbers = true)]
    pub plateau: f64,
    /// Pedals between which the lag is linear, %, rising.
    #[arg(long, value_name = "PERCENT", value_delimiter = ',', default_values_t = [0.0, 50.0, 100.0])]
    pub pedals: Vec<f64>,
    /// Speeds between which the lag is linear, rad/s, rising; without them the lowest, middle and highest of the steps.
    #[arg(long, value_name = "RAD_S", value_delimiter = ',')]
    pub speeds: Vec<f64>,
    /// Order of magnitude of the speeds' noise, rad/s: the observer's D.
    #[arg(long, value_name = "RAD_S", value_parser = positive, default_value_t = 0.02, allow_negative_numbers = true)]
    pub noise: f64,
    /// Rate of change of the engine's torque, N m/s: the observer's weight.
    #[arg(long, value_name = "NM_S", value_parser = positive, default_value_t = 200.0, allow_negative_numbers = true)]
    pub torque_rate: f64,
    /// m of the observer's matrix inequality over the least there is, above 1.
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 1.2, allow_negative_numbers = true)]
    pub back_off: f64,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
