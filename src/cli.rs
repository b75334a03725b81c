//! The command line: its doc comments are the help. One file per verb holds that verb's options, examples and exit codes;
//! what several verbs take is in `changes.rs`, `network.rs` and `run_result.rs`.

mod bag;
mod bridge;
mod changes;
mod compare;
mod device;
mod diagnose;
mod doctor;
mod export;
mod fit;
mod fleet;
mod gate;
mod graph;
mod init;
mod inspect;
mod live;
mod model;
mod network;
mod node;
mod prove;
mod replay;
mod run;
mod run_result;
mod secret;
mod shell;
mod simulate;
mod stability;
mod test_bench;
mod values;
mod why;

pub use bag::{Bag, BagExport, BagImport, ExportTo};
pub use bridge::Bridge;
pub use changes::words_of;
pub use compare::Compare;
pub use device::{Device, DeviceFind, DeviceNew, Emulate};
pub use diagnose::Diagnose;
pub use doctor::Doctor;
pub use export::Export;
pub use fit::Fit;
pub use fleet::Fleet;
pub use gate::Gate;
pub use graph::Graph;
pub use init::Init;
pub use inspect::Inspect;
pub use live::Live;
pub use model::{Model, ModelFile};
pub use node::{Node, SealedMaster, Step};
pub use prove::Prove;
pub use replay::Replay;
pub use run::Run;
pub use secret::Secret;
pub use shell::{Completions, Man};
pub use simulate::Simulate;
pub use stability::{GRIPS, Stability, spaced};
pub use test_bench::TestBench;
pub use why::{Why, WhyNow};

use clap::{Parser, Subcommand};

/// Find the effects that a model leaves out, from recordings; run force-reflecting telerobots, and analyse their stability.
///
/// Results go to standard output, all other messages to standard error.
/// Output options are the same in all verbs: --bag a bag, --csv a table, --html a page, --out other files (a model, a folder);
/// --json prints the result for programs.
///
/// Exit codes: 0 fine; 1 the finding is negative (not stable, bags differ); 2 usage; 3 bad input; 4 data was lost.
/// 5 prevented by this machine or its network (shared memory, disk, permission, a foreign sender on the run's topics).
/// 6 a node failed; 7 not known; 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "backdrive", version = env!("BACKDRIVE_VERSION"), propagate_version = true, arg_required_else_help = true)]
pub struct Cli {
    /// The verb.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a graph: every node its own process, every topic recorded.
    ///
    /// For a graph with a master, a scaling and a slave with an environment, the run reports whether its loop was stable. It is judged while the hand
    /// holds still in contact for at least 0.45 s. A run without such a rest, with lost messages or a lost node, or that ended early, is not called
    /// stable (exit 7). For a graph without such a loop, such as an identification, a successful run ends with 0.
    #[command(after_help = run::HELP)]
    Run(Run),
    /// Re-simulate a bag's graph with the recorded operator and your changes, and report whether the loop is stable.
    #[command(after_help = replay::HELP)]
    Replay(Replay),
    /// Compute from a recording whether the loop is stable at a gain, and how far the stability limit is.
    #[command(after_help = stability::HELP)]
    Stability(Stability),
    /// Find the cause of an oscillation in a recording, and remedies: causes with evidence, remedies tested by re-simulation.
    #[command(after_help = why::HELP)]
    Why(Why),
    /// Compare coupling laws and the canceller with the same hand: stability limit, transparency, tracking, effort.
    #[command(after_help = compare::HELP)]
    Compare(Compare),
    /// Check recordings without a model: what each signal is, what is wrong with it, and how each joint responds to its command.
    #[command(after_help = inspect::HELP)]
    Inspect(Inspect),
    /// Write a first model and a set for your own recordings: asks what is driven and measured, and checks the files.
    #[command(after_help = init::HELP)]
    Init(Init),
    /// Find which effects a model leaves out, from recordings.
    #[command(after_help = diagnose::HELP)]
    Diagnose(Diagnose),
    /// Refit a model's parameters to recordings without changing its structure: standard errors, correlations, agreement between records.
    #[command(after_help = fit::HELP)]
    Fit(Fit),
    /// Judge many recordings of many units: parameters of each, what changed on which unit since when, and units that differ.
    #[command(after_help = fleet::HELP)]
    Fleet(Fleet),
    /// Compare two sets of recordings: which physics, parameter, rate or sensor changed, and whether it matters by stated bounds.
    #[command(after_help = gate::HELP)]
    Gate(Gate),
    /// Identify an engine test bench from its bags: inertias, shaft, maps, linear part of the dynamometer, lag of the engine.
    #[command(after_help = test_bench::HELP)]
    TestBench(TestBench),
    /// Check a graph file; errors point at the line.
    #[command(after_help = graph::CHECK_HELP)]
    Check(Graph),
    /// Draw a graph.
    #[command(after_help = graph::DRAW_HELP)]
    Graph(Graph),
    /// Simulate a model with a recording, a set of recordings, or an excitation.
    #[command(after_help = simulate::HELP)]
    Simulate(Simulate),
    /// Export a model for MuJoCo, URDF, Isaac, or as a friction feed-forward, and report what the format cannot represent.
    #[command(after_help = export::HELP)]
    Export(Export),
    /// Show or check a model file.
    #[command(subcommand)]
    Model(Model),
    /// Show, compare, recover and convert bags.
    #[command(subcommand)]
    Bag(Bag),
    /// Remove the remains of dead runs in shared memory and on disk; active runs are not touched.
    #[command(
        after_help = "Example:\n  backdrive clean\n\nExit codes: 0 removed, or nothing to remove; 2 usage; 5 something could not be removed."
    )]
    Clean,
    /// Show a run in progress, or recordings, on a page: charts, the devices to scale; of a run also its gain, its canceller and a stop.
    #[command(after_help = live::HELP)]
    Live(Live),
    /// Find what answers on a bus, write a device's file, check it, or emulate a bus of servos.
    #[command(subcommand, after_help = "Example:\n  backdrive device find /dev/ttyUSB0")]
    Device(Device),
    /// Publish the topics of a local graph on ROS 2; nothing is received from there without --both-ways.
    #[command(after_help = bridge::HELP)]
    Bridge(Bridge),
    /// Create the secret with which the hosts of a run authenticate: copy it to each, and name it with `run --host NAME --secret FILE`.
    #[command(after_help = secret::HELP)]
    Secret(Secret),
    /// Check this machine for runs: shared memory, real-time rights, timers, multicast, socket buffers.
    #[command(after_help = doctor::HELP)]
    Doctor(Doctor),
    /// Test the diagnosis: conceal effects in a master, find them from a session's bags, and measure the gain in stability.
    #[command(after_help = prove::HELP)]
    Prove(Prove),
    /// Print a shell's completion script for this program.
    #[command(after_help = shell::COMPLETIONS_HELP)]
    Completions(Completions),
    /// Write manual pages: one for this program and one for every verb.
    #[command(after_help = shell::MAN_HELP)]
    Man(Man),
    /// A node of a graph that is a program in any language: it reads the inputs of each step, and writes the outputs.
    #[command(after_help = node::STEP_HELP)]
    Step(Step),
    /// One node of a running graph; the supervisor starts it.
    #[command(hide = true)]
    Node(Node),
    /// Why a loop shakes at this moment; a run that is watched starts it.
    #[command(hide = true)]
    WhyNow(WhyNow),
    /// The master of a proof; the supervisor starts it.
    #[command(hide = true)]
    SealedMaster(SealedMaster),
}
