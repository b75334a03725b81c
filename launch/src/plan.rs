//! What the supervisor needs to know of a graph.

use crate::place::Place;
use backdrive_nodes::graph::{Graph, Node, NodeKind};
use backdrive_nodes::stage::{Clock, Timing};
use std::path::{Path, PathBuf};

/// A graph as the supervisor sees it: processes, and how time runs.
#[derive(Debug, Clone)]
pub struct Plan {
    /// One line for a person.
    pub title: String,
    /// The graph's text, as each process reads it from the run directory.
    pub text: String,
    /// Files of a graph that comes from a bag: the name that stands in the text, and their text.
    pub held: Vec<(String, String)>,
    /// Rate, clock, number of steps.
    pub timing: Timing,
    /// The bag that is recorded, if one is.
    pub bag: Option<PathBuf>,
    /// At least one.
    pub nodes: Vec<NodePlan>,
    /// Where the nodes meet.
    pub place: Place,
    /// All hosts of the graph that have nodes, this one included; empty for a graph that runs on one host.
    pub hosts: Vec<String>,
}

/// One process.
#[derive(Debug, Clone, Default)]
pub struct NodePlan {
    /// Unique in the graph.
    pub name: String,
    /// The name of its kind, such as `master`.
    pub kind: String,
    /// Nodes that share the process with it.
    pub others: Vec<Named>,
    /// The user's own program and its arguments; `--run ROOT --name NAME` is added to them.
    pub command: Option<Vec<String>>,
    /// Whether it is started again when it dies (real time only).
    pub restart: bool,
    /// Whether it records: it is stopped last, has more time to end, and is never started again.
    pub records: bool,
    /// Whether changed gains are for it.
    pub has_gains: bool,
}

/// A node by its name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Named {
    /// Unique in the graph.
    pub name: String,
    /// The name of its kind, such as `master`.
    pub kind: String,
}

impl NodePlan {
    /// All nodes of the process.
    pub fn nodes(&self) -> impl Iterator<Item = Named> {
        std::iter::once(Named { name: self.name.clone(), kind: self.kind.clone() }).chain(self.others.iter().cloned())
    }

    /// The process for a person: the name of its node, or the names of its nodes, such as `scaling+canceller`.
    pub fn label(&self) -> String {
        self.nodes().map(|n| n.name).collect::<Vec<_>>().join("+")
    }
}

impl Plan {
    /// What the supervisor needs of this graph, on this host if it has several, and where its nodes meet.
    pub fn of(graph: &Graph, place: &Place) -> Plan {
        let here = |n: &&Node| place.host.as_deref().is_none_or(|host| graph.runs_on(n, host));
        let named = |n: &Node| Named { name: n.name.clone(), kind: n.kind.name().to_string() };
        // A process is where the node stands that leads it.
        let leads = |n: &&Node| graph.process_of(&n.name).first().is_some_and(|first| first.name == n.name);
        let nodes = graph.nodes.iter().filter(here).filter(leads).map(|n| NodePlan {
            name: n.name.clone(),
            kind: n.kind.name().to_string(),
            others: graph.process_of(&n.name).into_iter().skip(1).map(named).collect(),
            command: n.command.clone(),
            restart: n.restart,
            records: n.kind == NodeKind::Recorder,
            has_gains: graph.process_of(&n.name).iter().any(|n| n.kind.closes_loop()),
        });
        Plan {
            title: graph.title.clone(),
            text: graph.text.clone(),
            held: graph.files.iter().filter(|(name, _)| Path::new(name).is_relative()).cloned().collect(),
            timing: graph.timing.clone(),
            bag: graph.bag_of(place.host.as_deref()),
            nodes: nodes.collect(),
            place: place.clone(),
            hosts: match &place.host {
                None => Vec::new(),
                Some(_) => {
                    let busy = graph.hosts.iter().filter(|h| graph.nodes.iter().any(|n| graph.runs_on(n, &h.name)));
                    busy.map(|h| h.name.clone()).collect()
                }
            },
        }
    }

    /// The same on every host that runs this graph with the same options, wherever its files lie.
    pub(crate) fn fingerprint(&self) -> u64 {
        let Timing { rate_hz, clock, steps, .. } = &self.timing;
        let text = format!("{}|{rate_hz}|{clock:?}|{steps:?}|{}", self.title, self.hosts.join(","));
        text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
    }

    pub(crate) fn realtime(&self) -> bool {
        self.timing.clock == Clock::Realtime
    }
}
