//! What the supervisor needs to know of a graph.

use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_nodes::stage::{Clock, Timing};
use std::path::PathBuf;

/// A graph as the supervisor sees it: processes, and how time runs.
#[derive(Debug, Clone)]
pub struct Plan {
    /// One line for a person.
    pub title: String,
    /// The graph's text, as each process reads it from the run directory.
    pub text: String,
    /// Rate, clock, number of steps.
    pub timing: Timing,
    /// The bag that is recorded, if one is.
    pub bag: Option<PathBuf>,
    /// At least one.
    pub nodes: Vec<NodePlan>,
}

/// One process.
#[derive(Debug, Clone, Default)]
pub struct NodePlan {
    /// Unique in the graph.
    pub name: String,
    /// The name of its kind, such as `master`.
    pub kind: String,
    /// The user's own program and its arguments; `--run ROOT --name NAME` is added to them.
    pub command: Option<Vec<String>>,
    /// Whether it is started again when it dies (real time only).
    pub restart: bool,
    /// Whether it records: it is stopped last, has more time to end, and is never started again.
    pub records: bool,
    /// Whether changed gains are for it.
    pub has_gains: bool,
}

impl Plan {
    /// What the supervisor needs of this graph.
    pub fn of(graph: &Graph) -> Plan {
        let nodes = graph.nodes.iter().map(|n| NodePlan {
            name: n.name.clone(),
            kind: n.kind.name().to_string(),
            command: n.command.clone(),
            restart: n.restart,
            records: n.kind == NodeKind::Recorder,
            has_gains: n.kind == NodeKind::Scaling,
        });
        Plan {
            title: graph.title.clone(),
            text: graph.text.clone(),
            timing: graph.timing.clone(),
            bag: graph.bag.clone(),
            nodes: nodes.collect(),
        }
    }

    pub(crate) fn realtime(&self) -> bool {
        self.timing.clock == Clock::Realtime
    }
}
