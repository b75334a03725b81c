//! What is known of a run when it has ended.

use backdrive_nodes::protocol::NodeStatus;
use backdrive_nodes::stage::Clock;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What is known of a run when it has ended. A number that was not measured is `None`, never 0.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RunReport {
    /// Name of the run on this machine; its directory is gone when this is read.
    pub id: String,
    /// The graph's title.
    pub title: String,
    /// How time ran.
    pub clock: Clock,
    /// Steps per second that the graph asks for; `None` in reports of earlier versions.
    #[serde(default)]
    pub rate_hz: Option<f64>,
    /// Steps done by the node that did most.
    pub steps: u64,
    /// Steps that the graph asks for; `None` where it runs until it is stopped.
    pub planned_steps: Option<u64>,
    /// Wall-clock time from the first spawn until all were connected, s.
    pub startup_s: f64,
    /// Wall-clock time from step 0 until the last node but the recorder had ended, s.
    pub duration_s: f64,
    /// Steps per second of wall-clock time.
    pub steps_per_s: f64,
    /// The node whose loop times these are: the master, or without one the slowest.
    pub loop_node: Option<String>,
    /// Time for one step of that node, waiting included, median, µs.
    pub loop_p50_us: Option<f64>,
    /// The same, 99th percentile, µs.
    pub loop_p99_us: Option<f64>,
    /// Messages that a node or the recorder refused because their sender is not of the run; one message may be refused by several.
    #[serde(default)]
    pub refused: u64,
    /// Steps that ended after their deadline, over all nodes.
    pub missed_deadlines: u64,
    /// The node that missed most of them, if one missed any, and how many.
    #[serde(default)]
    pub latest_node: Option<(String, u64)>,
    /// Samples that a node other than the recorder did not get.
    pub lost: u64,
    /// Messages that the recorder did not get; `None` without a recorder.
    pub unrecorded: Option<u64>,
    /// The bag, if one was recorded.
    pub bag: Option<PathBuf>,
    /// Messages and bytes in the bag, as last reported by the recorder.
    pub recorded: Option<(u64, u64)>,
    /// In the order of the graph; nodes that share a process follow the one that leads it.
    pub nodes: Vec<NodeReport>,
    /// In the order in which they arrived, the first ten thousand.
    pub events: Vec<RunEvent>,
    /// Events beyond those.
    pub events_left_out: u64,
    /// Processes that ended unexpectedly, also those that were started again.
    pub deaths: Vec<Death>,
    /// Nodes that did not end when asked and were killed.
    pub killed: Vec<String>,
    /// Why the run ended.
    pub cause: Cause,
    /// What the loop did, such as `stable`; filled in from the bag.
    pub outcome: Option<String>,
    /// Largest magnitude of the contact force, N; filled in from the bag.
    pub peak_contact_force_n: Option<f64>,
}

/// One node of a run that has ended.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct NodeReport {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Its last report; missed deadlines and losses are summed over its lives, and the peak effort is that of the whole run. `None` if it never
    /// reported anything.
    pub status: Option<NodeStatus>,
    /// How often it was started again.
    pub restarts: u32,
    /// How its last life ended, such as `done`.
    pub end: String,
    /// Nodes that shared its process: restarts and the cause of the end refer to that process.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub with: Vec<String>,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunEvent {
    /// The node that reports it, or `supervisor`.
    pub node: String,
    /// Time since step 0 at which it was heard, s; `None` if the run had not started.
    pub t_s: Option<f64>,
    /// Step at which it happened; `None` if the supervisor reports it.
    pub step: Option<u64>,
    /// 0 info, 1 warning, 2 error.
    pub severity: u32,
    /// Machine-readable name.
    pub kind: String,
    /// A sentence.
    pub text: String,
    /// A number that belongs to it.
    pub value: Option<f64>,
}

/// A process that ended unexpectedly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Death {
    /// Name of the node.
    pub node: String,
    /// Time since step 0, s.
    pub t_s: f64,
    /// Steps that it had reported.
    pub steps: u64,
    /// Such as `was killed by signal 11 (SIGSEGV)`.
    pub how: String,
    /// Exit code, if it had one.
    pub code: Option<i32>,
    /// Signal, if one killed it.
    pub signal: Option<i32>,
    /// Its last lines on standard error.
    pub stderr: Vec<String>,
    /// Whether it was started again and joined the run.
    pub recovered: bool,
}

/// Why a run ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "why", rename_all = "snake_case")]
pub enum Cause {
    /// Every node has done its steps.
    Completed,
    /// A node ended by itself before its steps were done (lockstep).
    EndedEarly {
        /// Name of the node.
        node: String,
        /// Steps that it did.
        steps: u64,
    },
    /// A signal, or [`crate::Command::Stop`].
    Stopped {
        /// Such as `SIGINT`.
        by: String,
    },
    /// A process died and was not started again. In real time the rest may have run to its end.
    NodeDied {
        /// Name of the node.
        node: String,
        /// Such as `was killed by signal 11 (SIGSEGV)`.
        how: String,
    },
    /// Somebody who is not of the run sent on one of its topics that move something.
    Stranger {
        /// The node that refused it.
        node: String,
        /// Who it is, if known, and where.
        text: String,
    },
    /// A node reported that it cannot go on.
    NodeFailed {
        /// Name of the node.
        node: String,
        /// Its words.
        error: String,
        /// Exit code that it asks for.
        code: u8,
    },
}

impl RunReport {
    /// Whether every node did what it should until the run ended or was stopped. Losses do not count.
    pub fn orderly(&self) -> bool {
        matches!(self.cause, Cause::Completed | Cause::Stopped { .. }) && self.deaths.iter().all(|d| d.recovered) && self.killed.is_empty()
    }
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Cause::Completed => write!(f, "completed"),
            Cause::EndedEarly { node, steps } => write!(f, "node `{node}` ended on its own after {steps} steps"),
            Cause::Stopped { by } => write!(f, "stopped by {by}"),
            Cause::Stranger { node, text } => write!(f, "a stranger on the network, refused by `{node}`: {text}"),
            Cause::NodeDied { node, how } => write!(f, "node `{node}` {how}"),
            Cause::NodeFailed { node, error, .. } => write!(f, "node `{node}`: {error}"),
        }
    }
}
