//! What happened in a run, read from its bag.

use crate::collect::Collector;
use crate::outcome::{Outcome, Trace};
use crate::unjudged::Unjudged;
use backdrive_bags::{BagError, Reader};
use backdrive_msgs::{Margin, Message, margin as known};
use backdrive_nodes::graph::{Files, Graph, Node, NodeKind, Overrides, Settings};
use backdrive_nodes::protocol::MarginStatus;
use backdrive_plant::model::Motion;
use backdrive_plant::tomlfile::FileError;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What happened in a run.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Position scale times force scale at the start.
    pub loop_gain: f64,
    /// The same at the end: a scheduled change or the guard may have moved it.
    pub last_loop_gain: f64,
    /// What the loop did; `None` where there is no loop: `no_loop` states why.
    pub outcome: Option<Outcome>,
    /// Why there is no loop that could be judged, where there is none.
    pub no_loop: Option<&'static str>,
    /// Units of the force on the slave and of that on the master: N, or N m.
    pub force_units: [&'static str; 2],
    /// Largest magnitude of the environment's force on the slave, N or N m.
    pub peak_contact_force: Option<f64>,
    /// Largest magnitude of the force applied to the master, N or N m.
    pub peak_feedback_force: Option<f64>,
    /// Time of the first contact, s.
    pub first_contact_s: Option<f64>,
    /// Time in contact, s.
    pub contact_s: f64,
    /// How far the running loop was from its stability limit, in words; `None` where nothing asked for it.
    pub margin: Option<String>,
}

/// Why a bag does not tell what happened in its run.
#[derive(Debug, thiserror::Error)]
pub enum SummaryError {
    /// It cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// It holds no graph: it was cut off before, or is no bag of a run.
    #[error("{}: {why}", path.display())]
    NoGraph {
        /// The bag.
        path: PathBuf,
        /// Why there is none.
        why: String,
    },
    /// Its graph is wrong, or the changes are.
    #[error(transparent)]
    Graph(#[from] FileError),
}

/// The graph that a bag holds, with changes to it.
///
/// # Errors
/// The bag holds no graph, or one that is wrong with these changes.
pub fn graph_of(reader: &Reader, changes: &Overrides) -> Result<Graph, SummaryError> {
    let path = reader.path();
    let no_graph = |why: String| SummaryError::NoGraph { path: path.to_path_buf(), why };
    let not_begun = || reader.without_messages().unwrap_or_else(|| "is not a bag of a run: it contains no graph".to_string());
    let header = reader.header().ok_or_else(|| no_graph(not_begun()))?;
    if header.graph_toml.is_empty() {
        return Err(no_graph("contains recordings, but no graph to run".to_string()));
    }
    Ok(Graph::from_text(&header.graph_toml, path, changes, &Files::Bag(&header.files))?)
}

/// Unit of a force on a device.
fn force_unit(graph: &Graph, kind: NodeKind) -> &'static str {
    let motion = graph.node_of(kind).and_then(|node| match &node.settings {
        Settings::Master(files) | Settings::Slave(files) => files.model.as_ref().map(|model| model.motion),
        _ => None,
    });
    if motion == Some(Motion::Rotation) { "N m" } else { "N" }
}

/// Reads a bag and summarises what happened.
///
/// # Errors
/// The bag cannot be read, or holds no graph.
pub fn summarise(path: &Path) -> Result<Summary, SummaryError> {
    let reader = Reader::open(path)?;
    let graph = graph_of(&reader, &Overrides::default())?;
    let mut traces = Traces::of(&graph);
    for entry in reader.messages()? {
        let entry = entry?;
        if let Some(message) = entry.message(path)? {
            traces.take(&entry.topic.name, &message);
        }
    }
    let mut summary = traces.summary(&graph);
    summary.hold_back((!reader.ended_cleanly()).then_some(Unjudged::NotClosed));
    Ok(summary)
}

/// Collects what a verdict needs while messages go by, from a bag or from a run.
pub struct Traces {
    loops: Collector,
    /// Whether the loop's margin is asked for: it has a guard or a dither.
    asks_margin: bool,
    margins: Margins,
}

/// What a small dither cannot see.
const AT_AMPLITUDE: &str = "; at the amplitude of the dither, so friction may hide a nearer limit";

/// The margins that a running loop reported.
#[derive(Debug, Default)]
struct Margins {
    /// The last that is known or bounded, and the lowest that is known.
    last: Option<Margin>,
    lowest: Option<Margin>,
    /// What was reported last while the slave was in contact, and at all.
    unknown: Option<Margin>,
}

impl Margins {
    fn take(&mut self, margin: &Margin) {
        let is_lower = |other: &Margin| margin.factor < other.factor;
        match margin.known {
            known::KNOWN | known::ABOVE => {
                self.last = Some(*margin);
                if margin.known == known::KNOWN && self.lowest.as_ref().is_none_or(is_lower) {
                    self.lowest = Some(*margin);
                }
            }
            // Free motion at the end is no evidence on the contact before it.
            known::FREE if self.unknown.is_some() => {}
            _ => self.unknown = Some(*margin),
        }
    }

    /// `14x at 148 Hz at 12.9 s; lowest 6.9x at 88 Hz at 6.1 s`.
    fn text(&self, period_s: f64) -> String {
        let of = |margin: &Margin| {
            let status = MarginStatus { decay_per_s: None, ..MarginStatus::from(margin) };
            status.to_string().trim_start_matches("margin ").to_string()
        };
        let at = |margin: &Margin| format!("{}, at {:.1} s", of(margin), margin.step as f64 * period_s);
        match (&self.last, &self.lowest, &self.unknown) {
            (Some(last), Some(lowest), _) if lowest.step != last.step => {
                format!("{} (last known value); lowest {}{}", at(last), at(lowest), AT_AMPLITUDE)
            }
            (Some(last), ..) => format!("{} (last known value){AT_AMPLITUDE}", at(last)),
            (None, _, Some(unknown)) if unknown.known == known::NO_DITHER => {
                "not known: it is measured by a dither on the force channel, and this run has none (--dither adds one)".to_string()
            }
            (None, _, Some(unknown)) => format!("always {}", of(unknown)),
            (None, _, None) => "not known: no node reported one".to_string(),
        }
    }
}

impl Traces {
    /// Ready for the messages of a graph.
    pub fn of(graph: &Graph) -> Traces {
        let asks = |node: &Node| matches!(&node.settings, Settings::Scaling { guard, dither, .. } if *guard || !dither.is_empty());
        Traces {
            loops: Collector::of(graph, &graph.path.display().to_string()),
            asks_margin: graph.nodes.iter().any(asks),
            margins: Margins::default(),
        }
    }

    /// Hears a message.
    pub fn take(&mut self, topic: &str, message: &Message) {
        if let Message::Margin(margin) = message {
            self.margins.take(margin);
        }
        self.loops.take(topic, message);
    }

    /// The verdict on all that went by.
    pub fn summary(&self, graph: &Graph) -> Summary {
        let traces = self.loops.traces();
        let peak = |pick: fn(&Trace) -> &Vec<f64>| {
            let values = traces.iter().flat_map(|t| pick(t).iter()).filter(|f| !f.is_nan());
            values.fold(None, |m: Option<f64>, f| Some(m.unwrap_or(0.0).max(f.abs())))
        };
        // Rows in which any axis touches.
        let touching: BTreeSet<usize> =
            traces.iter().flat_map(|t| t.contact.iter().enumerate().filter(|(_, f)| **f != 0.0).map(|(i, _)| i)).collect();
        let outcome = self.loops.outcome();
        Summary {
            loop_gain: graph.gains.mu * graph.gains.lambda,
            last_loop_gain: self.loops.last_loop_gain(),
            outcome,
            no_loop: self.loops.no_loop().filter(|_| outcome.is_none()),
            force_units: [NodeKind::Slave, NodeKind::Master].map(|kind| force_unit(graph, kind)),
            peak_contact_force: peak(|t| &t.contact),
            peak_feedback_force: peak(|t| &t.feedback),
            first_contact_s: touching.first().map(|i| *i as f64 * graph.period_s()),
            contact_s: touching.len() as f64 * graph.period_s(),
            margin: self.asks_margin.then(|| self.margins.text(graph.period_s())),
        }
    }
}

impl Summary {
    /// Takes a green verdict back, where something that is not in the signals forbids it.
    pub fn hold_back(&mut self, by: Option<Unjudged>) {
        self.outcome = self.outcome.map(|outcome| outcome.held_back(by));
    }
}
