//! The command line: its doc comments are the help. One file per verb holds that verb's options, examples and exit codes;
//! what several verbs take is in `changes.rs`, `network.rs` and `run_result.rs`.

mod bag;
mod bridge;
mod changes;
mod compare;
mod diagnose;
mod doctor;
mod export;
mod fit;
mod graph;
mod init;
mod inspect;
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
pub use diagnose::Diagnose;
pub use doctor::Doctor;
pub use export::Export;
pub use fit::Fit;
pub use graph::Graph;
pub use init::Init;
pub use inspect::Inspect;
pub use model::{Model, ModelFile};
pub use node::{Node, SealedMaster};
pub use prove::Prove;
pub use replay::Replay;
pub use run::Run;
pub use secret::Secret;
pub use shell::{Completions, Man};
pub use simulate::Simulate;
pub use stability::{GRIPS, Stability, spaced};
pub use test_bench::TestBench;
pub use why::Why;

use clap::{Parser, Subcommand};

/// Run force-reflecting telerobots, record them, and ask whether they are stable.
///
/// Results go to standard output, everything else to standard error.
/// What is written is named alike in every verb: --bag a bag, --csv a table, --html a page, --out what else a verb makes (a model, a folder);
/// --json prints the result for programs.
/// Exit codes: 0 fine; 1 the finding is negative (not stable, bags differ); 2 usage; 3 bad input;
/// 4 data was lost; 5 this machine or its network does not let it (shared memory, disk, permission, a stranger on the run's topics); 6 a node failed;
/// 7 it cannot be told; 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "backdrive", version = env!("BACKDRIVE_VERSION"), propagate_version = true, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a graph: every node its own process, every topic recorded.
    ///
    /// Of a graph with a master, a scaling and a slave that can touch something the run says whether its loop was stable. It is judged while the hand
    /// holds still in contact for at least 0.45 s: a run that never does so, that lost messages or a node, or ended before its duration is not called
    /// stable (exit 7). Of a graph without such a loop, as of one that identifies a device, nothing is claimed, and a run that went well ends with 0.
    #[command(after_help = run::HELP)]
    Run(Run),
    /// Run a bag's graph again from its recorded operator, with what you change, and say whether it was stable.
    #[command(after_help = replay::HELP)]
    Replay(Replay),
    /// Ask a bag whether its loop would be stable at another gain, and how far away the edge is.
    #[command(after_help = stability::HELP)]
    Stability(Stability),
    /// Ask a bag why its loop shakes, and what would stop it: causes with their evidence, and remedies that were tried on the loop run again.
    #[command(after_help = why::HELP)]
    Why(Why),
    /// Run the same hand through each law between master and slave, and through the canceller: edge, transparency, tracking, effort.
    #[command(after_help = compare::HELP)]
    Compare(Compare),
    /// Ask whether recordings are right: what each signal is, what is wrong with it, how each joint answers its command. Needs no model.
    #[command(after_help = inspect::HELP)]
    Inspect(Inspect),
    /// Write a model and a set for recordings of your own: asks what is driven and what is measured, and checks what it wrote.
    #[command(after_help = init::HELP)]
    Init(Init),
    /// Find where a model and recordings part, and which physics the model leaves out.
    #[command(after_help = diagnose::HELP)]
    Diagnose(Diagnose),
    /// Refit a model's numbers to recordings, its structure as it is: standard errors, correlations, agreement between records.
    #[command(after_help = fit::HELP)]
    Fit(Fit),
    /// Identify an engine test bench from its bags: inertias, shaft, maps, the dynamometer's linear part, the engine's lag.
    #[command(after_help = test_bench::HELP)]
    TestBench(TestBench),
    /// Check a graph file; errors point at the line.
    #[command(after_help = graph::CHECK_HELP)]
    Check(Graph),
    /// Draw a graph.
    #[command(after_help = graph::DRAW_HELP)]
    Graph(Graph),
    /// Run a model on a recording, a set of recordings, or a named excitation.
    #[command(after_help = simulate::HELP)]
    Simulate(Simulate),
    /// Write a model for MuJoCo, as URDF, for Isaac, or as feed-forward of friction, and say what that leaves out.
    #[command(after_help = export::HELP)]
    Export(Export),
    /// Look at a model file.
    #[command(subcommand)]
    Model(Model),
    /// Look at bags and convert them.
    #[command(subcommand)]
    Bag(Bag),
    /// Remove what dead runs left in shared memory and on disk; live runs are not touched.
    #[command(
        after_help = "Example:\n  backdrive clean\n\nExit codes: 0 removed, or nothing to remove; 2 usage; 5 something could not be removed."
    )]
    Clean,
    /// Put the topics of a local graph on ROS 2; nothing is taken from there, unless other hosts of the graph are asked for with --both-ways.
    #[command(after_help = bridge::HELP)]
    Bridge(Bridge),
    /// Make the secret by which the hosts of a run know each other: copy it to each, and name it with `run --host NAME --secret FILE`.
    #[command(after_help = secret::HELP)]
    Secret(Secret),
    /// Say what of this machine would hurt a run: shared memory, real-time rights, timers, multicast, socket buffers.
    #[command(after_help = doctor::HELP)]
    Doctor(Doctor),
    /// Conceal effects in a master, find them from the bags of a session, and show what that is worth on the graph.
    #[command(after_help = prove::HELP)]
    Prove(Prove),
    /// Print what a shell needs to complete this program's verbs and options.
    #[command(after_help = shell::COMPLETIONS_HELP)]
    Completions(Completions),
    /// Write manual pages: one for this program and one for every verb.
    #[command(after_help = shell::MAN_HELP)]
    Man(Man),
    /// One node of a running graph; the supervisor starts it.
    #[command(hide = true)]
    Node(Node),
    /// The master of a proof; the supervisor starts it.
    #[command(hide = true)]
    SealedMaster(SealedMaster),
}
