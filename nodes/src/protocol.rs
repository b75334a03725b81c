//! What the supervisor and a node process say to each other: one JSON object per line, the supervisor's
//! on the node's standard input, the node's on its standard output. The end of standard input means
//! that the supervisor is gone, and the node ends.

use serde::{Deserialize, Serialize};

/// From the supervisor to a node.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "say", rename_all = "snake_case")]
pub enum ToNode {
    /// Every node is connected: step 0 is due at this CLOCK_MONOTONIC time, ns. For a node that was
    /// restarted the time is in the past and it joins at the step that is due.
    Start {
        /// CLOCK_MONOTONIC, ns.
        t0_ns: i64,
        /// Unix time at that moment, ns, for stamps.
        unix_ns: i64,
    },
    /// Finish the step at hand and end.
    Stop,
    /// Change the gains.
    Gains {
        /// Position scale.
        mu: f64,
        /// Force scale.
        lambda: f64,
        /// Ramp, s.
        ramp_s: f64,
    },
}

/// From a node to the supervisor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "say", rename_all = "snake_case")]
pub enum FromNode {
    /// Publishers and subscribers exist.
    Created,
    /// Every topic that it hears has its publisher and every topic that it speaks on has the listeners the graph names.
    Ready,
    /// Not ready after a while, because these are missing.
    Waiting {
        /// Such as `/master/measured_js: no publisher`.
        missing: Vec<String>,
    },
    /// About ten times a second.
    Status(NodeStatus),
    /// Something happened.
    Event {
        /// Step at which it happened.
        step: u64,
        /// 0 info, 1 warning, 2 error.
        severity: u32,
        /// Machine-readable name.
        kind: String,
        /// A sentence.
        text: String,
        /// A number that belongs to it.
        value: Option<f64>,
    },
    /// It has ended as it should; the last line.
    Done(NodeStatus),
    /// It ends because of this; the last line.
    Failed {
        /// One sentence.
        error: String,
        /// Exit code that the command line should end with.
        code: u8,
    },
}

/// How a node is doing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeStatus {
    /// Steps done.
    pub steps: u64,
    /// Steps that ended after their deadline.
    pub missed_deadlines: u64,
    /// Samples found missing by sequence number, over all inputs.
    pub lost: u64,
    /// Time for one step, waiting for inputs included, median, µs.
    pub loop_p50_us: f64,
    /// 99th percentile, µs.
    pub loop_p99_us: f64,
    /// Largest magnitude of effort on its outputs since the last status, N.
    pub peak_effort: f64,
    /// Only the recorder: messages written and bytes of the bag so far.
    pub recorded: Option<(u64, u64)>,
}
