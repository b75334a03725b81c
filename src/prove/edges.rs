//! The stable gain of a loop whose master is the hidden plant, with one canceller after another.

use super::hidden::{Hidden, core};
use crate::failure::Failure;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_stability::resimulate::edge::{Edge, Search, edge};
use backdrive_stability::resimulate::{OwnCores, RunOptions, Scenario};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Where edges are looked for: to 50, coarser than `stability` does, for every run asks another process at every step.
const SEARCH: Search = Search { lowest: 0.05, highest: 50.0, tolerance: 0.03, per_decade: 10, whole_grid: false };

/// A model that predicts the induced motion, and with which grip.
#[derive(Debug, Clone)]
pub struct Canceller {
    /// For tables.
    pub name: &'static str,
    /// `None`: nothing is cancelled.
    pub model: Option<PathBuf>,
    /// The grip that it assumes; `None` where its model holds the hand.
    pub grip: Option<PathBuf>,
}

/// The loop in which the gain is raised.
pub struct Loop<'a> {
    /// The graph file with the contact script.
    pub graph: &'a Path,
    /// Corner of the canceller's high-pass, Hz.
    pub high_pass_hz: f64,
    /// The master.
    pub hidden: &'a Hidden,
}

impl Loop<'_> {
    /// The edge with a canceller, the hand gripping `firmness` times as firmly as when it was recorded.
    pub fn edge(&self, canceller: &Canceller, firmness: f64, cancel: &AtomicBool) -> Result<Edge, Failure> {
        let none = || PathBuf::from("none");
        let changes = Overrides {
            master: Some(self.hidden.model.clone()),
            grip: Some(self.hidden.grip.clone().unwrap_or_else(none)),
            canceller: Some(canceller.model.clone().unwrap_or_else(none)),
            canceller_grip: Some(canceller.grip.clone().unwrap_or_else(none)),
            high_pass_hz: Some(self.high_pass_hz),
            limits: Some("ignored".to_string()),
            ..Overrides::default()
        };
        let graph = Graph::load(self.graph, &changes)?;
        let scenario = Scenario::new(graph, None, None).map_err(Failure::input)?;
        let hidden = self.hidden.clone();
        let runs = AtomicU32::new(1000);
        let own: OwnCores = Arc::new(move |graph, node, grip_scale| {
            (node.kind == NodeKind::Master)
                .then(|| core(graph, node, &hidden.words(runs.fetch_add(1, Ordering::Relaxed), grip_scale)))
        });
        let options = RunOptions { grip_scale: firmness, ..RunOptions::default() };
        edge(&scenario.with_own_cores(own), &SEARCH, &options, &|_, _| {}, cancel).map_err(Failure::input)
    }
}
