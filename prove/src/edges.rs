//! The stable gain of a loop with one canceller after another: its master is the diagnosed model, or, once the verdict is written, the hidden plant.

use super::hidden::Opened;
use crate::error::ProveError;
use backdrive_nodes::graph::{Graph, Hand, Limits, NodeKind, Overrides, Settings};
use backdrive_stability::resimulate::edge::{Edge, Search, edge};
use backdrive_stability::resimulate::{OwnCores, RunOptions, Scenario};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Range of the search for critical gains: to 50, coarser than `stability` does, for there are many. With the grip of the session the live graph is asked
/// too. There the loop is also examined about the critical gain, since noise and dry friction make verdicts flicker there.
const SEARCH: Search =
    Search { lowest: 0.05, floor: 0.05, highest: 50.0, tolerance: 0.03, per_decade: 8, whole_grid: false, around: false };

/// A model that predicts the induced motion, and with which grip.
#[derive(Debug, Clone)]
pub struct Canceller {
    /// For tables.
    pub name: &'static str,
    /// `None`: nothing is cancelled.
    pub model: Option<PathBuf>,
    /// The grip that it assumes; `None` where its model holds the hand.
    pub grip: Option<PathBuf>,
    /// Whether it estimates the hand while the loop runs.
    pub estimates_hand: bool,
    /// For one that does: the gain product from which on the models shake without a canceller.
    pub edge_without: Option<f64>,
}

impl Canceller {
    /// One that takes the hand from the file.
    pub fn fixed(name: &'static str, model: Option<PathBuf>, grip: Option<PathBuf>) -> Canceller {
        Canceller { name, model, grip, estimates_hand: false, edge_without: None }
    }
}

/// What the loop moves.
pub enum Moved<'a> {
    /// A model that holds the hand.
    Model(&'a Path),
    /// The hidden plant, with the nominal model that has its axes and limits, and the nominal grip.
    Hidden(&'a Path, Option<&'a Path>, Arc<Opened>),
}

/// The loop in which the gain is raised.
pub struct Loop<'a> {
    /// The graph file with the contact script.
    pub graph: &'a Path,
    /// Corner of the canceller's high-pass, Hz.
    pub high_pass_hz: f64,
    /// The master.
    pub master: Moved<'a>,
}

impl Loop<'_> {
    /// What the graph file's loop becomes with a canceller.
    pub fn changes(&self, canceller: &Canceller) -> Overrides {
        let none = || PathBuf::from("none");
        let (model, grip) = match &self.master {
            Moved::Model(model) => (*model, None),
            Moved::Hidden(model, grip, _) => (*model, *grip),
        };
        Overrides {
            master: Some(model.to_path_buf()),
            grip: Some(grip.map_or_else(none, Path::to_path_buf)),
            canceller: Some(canceller.model.clone().unwrap_or_else(none)),
            canceller_grip: Some(canceller.grip.clone().unwrap_or_else(none)),
            // Who estimates the hand has a rule of its own for what cannot be known at rest.
            high_pass_hz: Some(if canceller.estimates_hand { 0.0 } else { self.high_pass_hz }),
            hand: canceller.estimates_hand.then_some(Hand::Estimated),
            edge_without: canceller.edge_without,
            limits: Some(Limits::Ignored),
            ..Overrides::default()
        }
    }

    /// The critical gain with a canceller, the hand gripping `firmness` times as firmly as when it was recorded.
    pub fn edge(&self, canceller: &Canceller, firmness: f64, cancel: &AtomicBool) -> Result<Edge, ProveError> {
        let scenario = self.scenario(canceller, firmness)?;
        let options = RunOptions { grip_scale: firmness, ..RunOptions::default() };
        let around = firmness == 1.0 && matches!(self.master, Moved::Hidden(..)) && scenario.duration_s() < LONG_S;
        edge(&scenario, &Search { around, ..SEARCH }, &options, &|_, _| {}, cancel).map_err(ProveError::input)
    }

    /// The loop with a canceller, ready to be run.
    pub fn scenario(&self, canceller: &Canceller, firmness: f64) -> Result<Scenario, ProveError> {
        let changes = self.changes(canceller);
        let mut graph = Graph::load(self.graph, &changes)?;
        let device = match &self.master {
            Moved::Model(_) => {
                firmer(&mut graph, firmness);
                None
            }
            Moved::Hidden(.., device) => {
                device.tell_sensors(&mut graph);
                Some(device.clone())
            }
        };
        let scenario = Scenario::new(graph, None, None).map_err(ProveError::input)?;
        let Some(device) = device else { return Ok(scenario) };
        let own: OwnCores = Arc::new(move |graph, node, firmness| {
            (node.kind == NodeKind::Master).then(|| device.core(graph, node, number_at(graph.gains.mu * graph.gains.lambda), firmness))
        });
        Ok(scenario.with_own_cores(own))
    }
}

/// Least length of a run for which the critical gain is not checked again from both sides, s.
const LONG_S: f64 = 8.0;

/// Numbers of runs of the hidden plant from this on are of runs at a gain.
const AT_GAINS: u32 = 10_000;

/// The run's number, which its noise comes from: another one at each gain, and at one gain the same with all cancellers.
fn number_at(gain: f64) -> u32 {
    let bits = gain.to_bits();
    ((bits ^ (bits >> 32)) as u32).max(AT_GAINS)
}

/// The hand of a master whose model holds it grips `factor` times as firmly.
fn firmer(graph: &mut Graph, factor: f64) {
    for node in graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Master) {
        let Settings::Master(files) = &mut node.settings else { continue };
        let Some(model) = &mut files.model else { continue };
        model.scale_own_hand(factor);
    }
}
