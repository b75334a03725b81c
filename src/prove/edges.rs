//! The stable gain of a loop whose master is the hidden plant, with one canceller after another. The verdict is written by then.

use super::hidden::Opened;
use crate::failure::Failure;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_stability::resimulate::edge::{Edge, Search, edge};
use backdrive_stability::resimulate::{OwnCores, RunOptions, Scenario};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Where edges are looked for: to 50, coarser than `stability` does, for there are many.
const SEARCH: Search = Search { lowest: 0.05, highest: 50.0, tolerance: 0.03, per_decade: 8, whole_grid: false, around: false };

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
    /// The nominal master: its axes and limits are known.
    pub model: &'a Path,
    /// The nominal grip.
    pub grip: Option<&'a Path>,
    /// The master.
    pub device: Arc<Opened>,
}

impl Loop<'_> {
    /// The edge with a canceller, the hand gripping `firmness` times as firmly as when it was recorded.
    pub fn edge(&self, canceller: &Canceller, firmness: f64, cancel: &AtomicBool) -> Result<Edge, Failure> {
        let none = || PathBuf::from("none");
        let changes = Overrides {
            master: Some(self.model.to_path_buf()),
            grip: Some(self.grip.map_or_else(none, Path::to_path_buf)),
            canceller: Some(canceller.model.clone().unwrap_or_else(none)),
            canceller_grip: Some(canceller.grip.clone().unwrap_or_else(none)),
            high_pass_hz: Some(self.high_pass_hz),
            limits: Some("ignored".to_string()),
            ..Overrides::default()
        };
        let mut graph = Graph::load(self.graph, &changes)?;
        self.device.tell_sensors(&mut graph);
        let scenario = Scenario::new(graph, None, None).map_err(Failure::input)?;
        let device = self.device.clone();
        let runs = AtomicU32::new(1000);
        let own: OwnCores = Arc::new(move |graph, node, firmness| {
            (node.kind == NodeKind::Master).then(|| device.core(graph, node, runs.fetch_add(1, Ordering::Relaxed), firmness))
        });
        let options = RunOptions { grip_scale: firmness, ..RunOptions::default() };
        edge(&scenario.with_own_cores(own), &SEARCH, &options, &|_, _| {}, cancel).map_err(Failure::input)
    }
}
