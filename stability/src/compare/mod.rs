//! The same hand and the same environment with alternatives to the canceller: stability limit, transparency, tracking and effort of each, over link
//! conditions.

pub mod asked;
mod condition;
mod measures;
mod rival;
#[cfg(test)]
mod tests;

pub use condition::{Condition, Varied};
pub use measures::Measures;
pub use rival::Rival;

use crate::outcome::Outcome;
use crate::resimulate::edge::{Search, edge};
use crate::resimulate::{Gain, ResimulateError, RunOptions, Scenario};
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::Graph;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A rival under one condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Its word.
    pub rival: String,
    /// What the link and the hand do.
    pub condition: Condition,
    /// What the loop does at the gain of the comparison.
    pub outcome: Outcome,
    /// The lowest mu*lambda at which the loop oscillates or runs away; `None` where there is none in the range or a clamp comes first.
    pub critical_gain: Option<f64>,
    /// The highest mu*lambda below that was found stable; 0 where none was.
    pub stable_up_to: f64,
    /// Frequency just above the stability limit, Hz; 0 for a run-away without oscillation.
    pub critical_frequency_hz: Option<f64>,
    /// What ends the stable range, in a sentence.
    pub edge: String,
    /// What was measured at the gain of the comparison.
    pub measures: Measures,
}

/// Rivals whose loops are compared, with the session that all of them get.
pub struct Comparison {
    /// Each rival with the graph in which it runs.
    pub rivals: Vec<(Rival, Graph)>,
    /// Under each of these.
    pub conditions: Vec<Condition>,
    /// The hand, per axis; the graph's own operator where `None`.
    pub intents: Option<Vec<Intent>>,
    /// Range of gains that is searched for the stability limits.
    pub search: Search,
}

impl Comparison {
    /// Gains that are searched for stability limits: four per decade, then refined to 5 %.
    pub const SEARCH: Search =
        Search { lowest: 0.05, floor: 0.005, highest: 20.0, tolerance: 0.05, per_decade: 4, whole_grid: false, around: false };

    /// How many cells there will be.
    pub fn cells(&self) -> usize {
        self.rivals.len() * self.conditions.len()
    }

    /// Runs all cells in parallel, condition by condition; `None` stands for one that was not done when `cancel` was set. `done` hears
    /// how many are finished.
    ///
    /// # Errors
    /// The first cell that cannot be run.
    pub fn run(&self, done: &(dyn Fn(usize) + Sync), cancel: &AtomicBool) -> Result<Vec<Option<Cell>>, ResimulateError> {
        let finished = AtomicUsize::new(0);
        let pairs: Vec<_> = self.conditions.iter().flat_map(|c| self.rivals.iter().map(move |r| (c, r))).collect();
        let one = |(condition, (rival, graph)): (&Condition, &(Rival, Graph))| match self.cell(*rival, graph, condition, cancel) {
            Ok(cell) => {
                done(finished.fetch_add(1, Ordering::Relaxed) + 1);
                Ok(Some(cell))
            }
            Err(ResimulateError::Cancelled) => Ok(None),
            Err(error) => Err(error),
        };
        pairs.into_par_iter().with_max_len(1).map(one).collect()
    }

    fn cell(&self, rival: Rival, graph: &Graph, condition: &Condition, cancel: &AtomicBool) -> Result<Cell, ResimulateError> {
        let mut graph = graph.clone();
        condition.impair(&mut graph);
        let gain = Gain { mu: graph.gains.mu, lambda: graph.gains.lambda };
        let scenario = Scenario::new(graph, self.intents.clone(), None)?;
        let options = RunOptions { grip_scale: condition.grip_scale, keep_signals: true, ..RunOptions::default() };
        let run = scenario.run(gain, &options, cancel)?;
        let edge = edge(&scenario, &self.search, &options, &|_, _| (), cancel)?;
        let measures = run.signals.as_ref().map(|session| Measures::of(session, &run.outcome)).unwrap_or_default();
        Ok(Cell {
            rival: rival.word().to_owned(),
            condition: condition.clone(),
            outcome: run.outcome,
            critical_gain: edge.critical_gain,
            stable_up_to: edge.at_least,
            critical_frequency_hz: edge.frequency_hz,
            edge: edge.reason,
            measures,
        })
    }
}
