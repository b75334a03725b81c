//! What a process does: stages, each a core with its input and output ports bound to topics.

use backdrive_control::core::Core;
use backdrive_msgs::topic::Topic;
use serde::{Deserialize, Serialize};

/// Name of an input port that only holds its stage back, such as a source's in lockstep: its delay is how
/// far the stage may be ahead. The core does not see it, and where all stages run in one thread it is not needed.
pub const PACE_PORT: &str = "pace";

/// How time runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// A node does step k when its inputs for k are there: as fast as the machine allows, and reproducible.
    #[default]
    Lockstep,
    /// An absolute-deadline timer at the graph's rate.
    Realtime,
}

impl Clock {
    /// Each with its word in a graph file.
    pub const ALL: [(&'static str, Clock); 2] = [("lockstep", Clock::Lockstep), ("realtime", Clock::Realtime)];

    /// Its word in a graph file.
    pub fn word(self) -> &'static str {
        Clock::ALL[self as usize].0
    }
}

/// What is done to a connection on purpose, to see what the loop makes of it. Seeded, and applied at the receiver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Impairment {
    /// Added delay, s (rounded to whole steps).
    pub delay_s: f64,
    /// Largest further delay, uniformly distributed, s; samples may overtake each other, and a late one is dropped.
    pub jitter_s: f64,
    /// Share of samples lost, 0 to 1.
    pub loss: f64,
    /// Seed of jitter and loss.
    pub seed: u64,
}

/// An input port of a stage.
///
/// At step k it is satisfied when a sample of step k - delay or later has arrived, and then holds the
/// newest sample of step k - delay or earlier. While k < delay it holds nothing and is satisfied.
#[derive(Debug, Clone)]
pub struct InputPort {
    /// Name of the port, such as `force`.
    pub name: String,
    /// Where it listens.
    pub topic: Topic,
    /// Steps by which it lags.
    pub delay: u64,
    /// What is done to it on purpose.
    pub impairment: Option<Impairment>,
}

/// An output port of a stage.
#[derive(Debug, Clone)]
pub struct OutputPort {
    /// Name of the port, such as `measured`.
    pub name: String,
    /// Where it speaks.
    pub topic: Topic,
    /// Axes of its samples.
    pub axes: usize,
}

/// A core with its ports.
pub struct Stage {
    /// Name within the node, such as `forward`.
    pub name: String,
    /// In the order in which the core expects them.
    pub inputs: Vec<InputPort>,
    /// In the order in which the core fills them.
    pub outputs: Vec<OutputPort>,
    /// What it computes.
    pub core: Box<dyn Core>,
}

/// Everything that one process does. Its stages step separately, each as soon as its own inputs are there.
pub struct NodePlan {
    /// Name of the node, unique in the graph.
    pub name: String,
    /// At least one.
    pub stages: Vec<Stage>,
    /// Where its events go: `/NAME/events`.
    pub events: Topic,
    /// Where its health goes: `/NAME/status`.
    pub status: Topic,
    /// Where wanted gains come from, if a stage has gains.
    pub gains_in: Option<Topic>,
    /// Where the gains in force are published, if a stage has gains: at step 0 and whenever they change.
    pub gains_out: Option<Topic>,
    /// Where the loop's margin is published ten times a second, if a stage knows of it.
    pub margin_out: Option<Topic>,
    /// Lists of named numbers that the first stage's core reports ten times a second: topic, and how many numbers.
    pub lists: Vec<(Topic, usize)>,
}

/// What all nodes of a graph share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Steps per second, up to 10 000.
    pub rate_hz: f64,
    /// How time runs.
    pub clock: Clock,
    /// Steps after which every node ends; `None` until it is stopped.
    pub steps: Option<u64>,
    /// Lockstep only: how long a node waits for a missing input before it ends the run with an event, s.
    pub peer_timeout_s: f64,
}
