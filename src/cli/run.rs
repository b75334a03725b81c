//! Options of `backdrive run`.

use super::changes::Changes;
use super::network::Network;
use super::run_result::RunResult;
use super::values::choices;
use backdrive_nodes::stage::Clock;
use backdrive_runs::way::Transport;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive run launch/contact.toml --master plant/models/rigid-mass.toml --lambda 0.2 --bag rigid.mcap
  backdrive run rigid.mcap --lambda 0.4
  backdrive run launch/contact.toml --clock realtime --duration 60 --live

A bag that the graph file names and that exists already is kept: the run writes NAME-2.mcap, NAME-3.mcap, ... and reports it.

Exit codes: 0 stable, or no loop to judge; 1 not stable; 7 not known; 4 data lost, 6 a node failed, 130 interrupted.";

/// `backdrive run`
#[derive(Debug, Args)]
pub struct Run {
    /// The graph file, or a bag: its graph is run with the files and options of the recorded run.
    pub graph: PathBuf,
    /// Transport of messages: shared memory without --host, otherwise ROS 2.
    #[arg(long, value_parser = choices([
        ("iceoryx2", "A process per node over shared memory", Transport::Iceoryx2),
        ("ros2", "A process per node over ROS 2 (DDS)", Transport::Ros2),
        ("inproc", "All nodes in this process", Transport::Inproc),
    ]))]
    pub transport: Option<Transport>,
    /// Run only the graph's nodes of this host, together with the other hosts.
    #[arg(long, value_name = "NAME")]
    pub host: Option<String>,
    /// File with the secret that the hosts share, made by `backdrive secret FILE` and copied to each; needed with --host.
    #[arg(long, value_name = "FILE")]
    pub secret: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub network: Network,
    /// Clock of the run.
    #[arg(long, value_parser = choices([
        ("lockstep", "As fast as the machine allows, and reproducible", Clock::Lockstep),
        ("realtime", "With the wall clock", Clock::Realtime),
    ]))]
    pub clock: Option<Clock>,
    /// Folder for the recordings of a graph with experiments.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Show the run on a page while it lasts: charts, the devices to scale, a slider for lambda, a stop. ADDRESS is 127.0.0.1 and a free port unless stated.
    ///
    /// The page's address, with a token in it, is printed at the start. Only with --clock realtime the run goes at its own speed.
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, require_equals = true, default_missing_value = "127.0.0.1:0")]
    pub live: Option<SocketAddr>,
    /// Greatest lambda that may be set from the page: by default 10 times that of the graph with a guard, and that of the graph without one.
    #[arg(long, value_name = "LAMBDA", requires = "live")]
    pub most_lambda: Option<f64>,
    /// Watch for shaking: report its onset within 0.3 s, then its cause and the gain at which the loop would be calm, from what was recorded so far.
    #[arg(long)]
    pub why: bool,
    /// As --why, and lower lambda by a ramp to that gain; undone where it does not help. Never below LEAST, a tenth of the graph's lambda unless stated.
    #[arg(long, value_name = "LEAST", num_args = 0..=1, require_equals = true)]
    pub heal: Option<Option<f64>>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub result: RunResult,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub changes: Changes,
}
