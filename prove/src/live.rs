//! Whether the live graph agrees: processes over shared memory with the hidden plant in the master's place, just below a critical gain and just above it.

use super::edges::{Canceller, Loop};
use super::files::{absolute, ours, write};
use super::hidden::{Hidden, Opened};
use crate::error::ProveError;
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_stability::resimulate::edge::Edge;
use serde::Serialize;
use serde_json::Value;
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, value};

/// Where the live graph is run, as factors on the highest gain found stable and on the lowest found not stable. Where verdicts flicker about the critical
/// gain, the factors apply to the ends of that range.
const BELOW: f64 = 0.9;
const ABOVE: f64 = 1.15;

/// One run of the live graph.
#[derive(Debug, Clone, Serialize)]
pub struct LiveRun {
    /// Which canceller.
    pub canceller: &'static str,
    /// mu*lambda.
    pub gain: f64,
    /// Whether the critical gain lies above this gain, so that the run should be stable.
    pub below_edge: bool,
    /// What the run did: `stable`, `limit_cycle`, `unstable`, `limited`, `cannot_tell`.
    pub outcome: String,
}

impl LiveRun {
    /// Whether its outcome agrees with the critical gain.
    pub fn agrees(&self) -> bool {
        // A run that was not judged agrees with nothing.
        self.outcome != "cannot_tell" && (self.outcome == "stable") == self.below_edge
    }
}

/// What the session's graph file needs to have the hidden plant in its master's place.
pub(crate) fn hide(graph: &mut DocumentMut, backdrive: &Path, hidden: &Hidden, number: u32) -> Result<(), ProveError> {
    let nodes = graph.get_mut("nodes").and_then(Item::as_array_of_tables_mut);
    for node in nodes.into_iter().flat_map(|n| n.iter_mut()) {
        if node.get("kind").and_then(Item::as_str) == Some("master") {
            let mut words = Array::new();
            words.push(backdrive.display().to_string());
            words.push("sealed-master");
            for word in hidden.words(number, 1.0) {
                words.push(format!("--word={word}"));
            }
            node["command"] = value(words);
        }
    }
    Ok(())
}

/// Runs the live graph about a critical gain. Files stay in `folder`.
///
/// # Errors
/// A file that cannot be written, or a run that cannot be done.
pub(crate) fn about(
    backdrive: &Path,
    folder: &Path,
    the_loop: &Loop,
    canceller: &Canceller,
    edge: &Edge,
    hidden: &Hidden,
    device: &Opened,
) -> Result<Vec<LiveRun>, ProveError> {
    let flickers = edge.flickers.map(|[_, highest_stable]| highest_stable);
    let above = edge.critical_gain.or(edge.limited_from).map(|gain| flickers.map_or(gain, |highest| gain.max(highest)));
    let points = [(edge.at_least > 0.0).then_some((BELOW * edge.at_least, true)), above.map(|gain| (ABOVE * gain, false))];
    std::fs::create_dir_all(folder).map_err(|e| ProveError::write(folder, e))?;
    let mut runs = Vec::new();
    for (gain, below_edge) in points.into_iter().flatten() {
        let side = if below_edge { "below" } else { "above" };
        let name = format!("{}-{side}", canceller.name.replace([' ', ','], "-"));
        let changes = the_loop.changes(canceller);
        let mut graph = Graph::load(the_loop.graph, &changes)?;
        device.tell_sensors(&mut graph);
        let model = folder.join("master.toml");
        write(&model, &master_model(&graph)?)?;
        let mut text: DocumentMut = graph.text.parse().map_err(ProveError::input)?;
        hide(&mut text, backdrive, hidden, 2000 + runs.len() as u32)?;
        let nodes = text.get_mut("nodes").and_then(Item::as_array_of_tables_mut);
        for node in nodes.into_iter().flat_map(|n| n.iter_mut()) {
            match node.get("kind").and_then(Item::as_str) {
                Some("master") => node["model"] = value(absolute(&model)?),
                Some("recorder") => node["bag"] = value(absolute(&folder.join(format!("{name}.mcap")))?),
                _ => {}
            }
        }
        text["gains"]["lambda"] = value(gain / graph.gains.mu);
        let path = folder.join(format!("{name}.toml"));
        write(&path, text.to_string())?;
        let said = ours(backdrive, folder, &name, &[&"run", &path, &"--json", &"--overwrite"])?;
        let json = said.lines().find_map(|line| serde_json::from_str::<Value>(line).ok());
        let outcome = json.and_then(|v| v["outcome"].as_str().map(str::to_string));
        let outcome =
            outcome.ok_or_else(|| ProveError::input(format!("{}: the run does not report the motion of the loop", path.display())))?;
        runs.push(LiveRun { canceller: canceller.name, gain, below_edge, outcome });
    }
    Ok(runs)
}

/// The model of the master of a graph, as a file.
fn master_model(graph: &Graph) -> Result<String, ProveError> {
    let files = graph.nodes.iter().find(|n| n.kind == NodeKind::Master).map(|n| &n.settings);
    match files {
        Some(Settings::Master(files)) if files.model.is_some() => Ok(files.model.as_ref().map_or_else(String::new, |m| m.to_toml())),
        _ => Err(ProveError::input(format!("{}: has no master with a model", graph.path.display()))),
    }
}
