//! What the hand does in a re-simulation, where it is not what the bag's did: the operator of another graph file.

use super::Scenario;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use backdrive_plant::tomlfile::FileError;
use std::path::Path;

/// A named motion of the hand.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// Title of the graph that it comes from.
    pub name: String,
    /// The hand's intended motion, per axis.
    pub intents: Vec<Intent>,
    /// Length, s; `None` where the graph has none.
    pub duration_s: Option<f64>,
}

impl Script {
    /// The operator of a graph file: its waypoints or sine, per axis.
    ///
    /// # Errors
    /// A file that is no graph, or one without an operator that moves.
    pub fn from_graph(path: &Path) -> Result<Script, FileError> {
        let graph = Graph::load(path, &Overrides::default())?;
        let name = path.display().to_string();
        match graph.node_of(NodeKind::Operator).map(|n| &n.settings) {
            Some(Settings::Operator(intents)) => {
                if intents.iter().all(|i| *i == Intent::Rest) {
                    return Err(FileError::whole(&name, "its operator rests, so there would be no contact; give it waypoints"));
                }
                let title = if graph.title.is_empty() { name } else { graph.title.clone() };
                Ok(Script { name: title, intents: intents.clone(), duration_s: graph.duration_s() })
            }
            _ => Err(FileError::whole(&name, "has no operator node, so it does not describe a motion of the hand")),
        }
    }
}

impl Scenario {
    /// The same loop moved by a script, for as long as that lasts.
    pub fn with_script(mut self, script: &Script) -> Scenario {
        for node in self.graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Operator) {
            node.settings = Settings::Operator(script.intents.clone());
        }
        if let Some(duration_s) = script.duration_s {
            self.steps = ((duration_s * self.graph.timing.rate_hz).round() as u64).max(1);
            self.graph.timing.steps = Some(self.steps);
        }
        self.script.clone_from(&script.name);
        self
    }
}
