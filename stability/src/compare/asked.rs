//! What is compared, from what is asked.

use super::{Comparison, Condition, Rival};
use crate::asked::AskedError;
use crate::resimulate::recover::recorded_intents;
use crate::session::Session;
use crate::summary::graph_of;
use backdrive_bags::Reader;
use backdrive_control::coupling::LawKind;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use std::fmt::Display;
use std::path::PathBuf;

/// What is asked of a session.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A graph file with an operator, or the bag of a run, whose hand is then played.
    pub session: PathBuf,
    /// What is compared; all where none is named.
    pub laws: Vec<Rival>,
    /// Changes to the graph, which name no coupling.
    pub changes: Overrides,
    /// What the link and the hand do.
    pub conditions: Vec<Condition>,
}

/// A comparison that is ready to run.
pub struct Asked {
    /// The rivals, their graphs and their conditions.
    pub comparison: Comparison,
    /// What a reader has to know. One sentence each.
    pub notes: Vec<String>,
}

fn wrong(error: impl Display) -> AskedError {
    AskedError(error.to_string())
}

impl Asked {
    /// Reads the session and settles each rival in its graph.
    ///
    /// # Errors
    /// The session cannot be read, holds no hand, or its graph does not take a rival or the changes.
    pub fn read(options: &Options) -> Result<Asked, AskedError> {
        let path = &options.session;
        let bag = match path.extension().is_some_and(|e| e == "mcap") {
            true => Some(Reader::open_begun(path).map_err(wrong)?),
            false => None,
        };
        let load = |law: LawKind| -> Result<Graph, AskedError> {
            let changes = Overrides { coupling: Some(law), ..options.changes.clone() };
            match &bag {
                Some(reader) => graph_of(reader, &changes).map_err(wrong),
                None => Graph::load(path, &changes).map_err(wrong),
            }
        };
        let intents = bag.as_ref().map(intents).transpose()?;
        let mut notes = Vec::new();
        let mut rivals = Vec::new();
        let all = Rival::all().into_iter().map(|(_, rival)| rival);
        let asked = |rival: &Rival| options.laws.is_empty() || options.laws.contains(rival);
        for rival in all.filter(asked) {
            let mut graph = load(rival.law())?;
            let node = graph.node_of(NodeKind::Canceller).is_some();
            if rival == Rival::Canceller && !node && options.laws.is_empty() {
                notes.push("the graph has no canceller node, so the laws are compared without the canceller".to_string());
                continue;
            }
            let before = knows(&graph);
            rival.settle(&mut graph).map_err(wrong)?;
            match (rival, before, knows(&graph)) {
                (Rival::Canceller, false, true) => notes.push(
                    "the graph's canceller subtracts nothing: in this comparison it uses the exact model of the simulated master \
                        and its grip"
                        .to_string(),
                ),
                (Rival::Law(LawKind::Direct), true, false) => notes.push("the laws run without the graph's canceller".to_string()),
                _ => {}
            }
            rivals.push((rival, graph));
        }
        let comparison = Comparison { rivals, conditions: options.conditions.clone(), intents, search: Comparison::SEARCH };
        if comparison.rivals.iter().any(|(_, g)| g.gains.mu * g.gains.lambda <= 0.0) {
            return Err(AskedError(format!(
                "{}: mu*lambda is 0, so no force would be reflected; name a force scale with --lambda",
                path.display()
            )));
        }
        Ok(Asked { comparison, notes })
    }
}

/// Whether a graph's canceller has a model.
fn knows(graph: &Graph) -> bool {
    matches!(graph.node_of(NodeKind::Canceller).map(|n| &n.settings), Some(Settings::Canceller(files, ..)) if files.model.is_some())
}

/// The hand in a bag.
fn intents(reader: &Reader) -> Result<Vec<Intent>, AskedError> {
    let graph = graph_of(reader, &Overrides::default()).map_err(wrong)?;
    let session = Session::from_bag(reader, &graph).map_err(wrong)?;
    recorded_intents(&session)
        .ok_or_else(|| AskedError(format!("{}: the hand's motion was not recorded; compare a graph file instead", reader.path().display())))
}
