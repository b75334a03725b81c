//! A loop that is re-simulated: a graph, and what its sensors do besides.

use crate::faulty::{Distortion, Faulty};
use backdrive_control::core::Core;
use backdrive_control::operator::Intent;
use backdrive_msgs::source_id;
use backdrive_nodes::build::cores_of;
use backdrive_nodes::graph::{Graph, Node};
use backdrive_stability::by_itself::alone::{AloneError, PutOut, alone, alone_with};
use backdrive_stability::by_itself::recorded::Recorded;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::edge::{Edge, Search, edge};
use backdrive_stability::resimulate::{Gain, OwnCores, ResimulateError, Run, RunOptions, Scenario};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Stability limits are searched within this factor of the gain in question, either way.
const AROUND: f64 = 20.0;

/// A loop.
#[derive(Clone)]
pub struct Trial {
    /// Nodes, connections, gains.
    pub graph: Graph,
    /// What happens to signals.
    pub distortions: Vec<Distortion>,
    /// The caller's own cores instead of some nodes: a device that is not simulated here.
    pub own: Option<OwnCores>,
}

impl std::fmt::Debug for Trial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Trial").field("graph", &self.graph.title).field("distortions", &self.distortions).finish_non_exhaustive()
    }
}

/// What the hand does, and for how long.
#[derive(Debug, Clone)]
pub struct Hand {
    /// Per axis, one row per step of the bag; the graph's own operator where `None`.
    pub intents: Option<Vec<Intent>>,
    /// Steps of the bag that are re-simulated.
    pub steps: u64,
    /// The bag's rate, Hz.
    pub rate_hz: f64,
}

impl Trial {
    /// An unchanged graph.
    pub fn of(graph: Graph) -> Trial {
        Trial { graph, distortions: Vec::new(), own: None }
    }

    /// Ready to be run with a hand; at another rate than the bag's the hand does the same in the same time.
    ///
    /// # Errors
    /// A graph that has no loop, or a node that cannot be built.
    pub fn scenario(&self, hand: &Hand) -> Result<Scenario, ResimulateError> {
        let times = self.graph.timing.rate_hz / hand.rate_hz;
        let steps = ((hand.steps as f64 * times).round() as u64).max(1);
        let intents = hand.intents.as_ref().map(|all| all.iter().map(|i| at_rate(i, times)).collect());
        let scenario = Scenario::new(self.graph.clone(), intents, Some(steps))?;
        Ok(match self.cores() {
            Some(cores) => scenario.with_own_cores(cores),
            None => scenario,
        })
    }

    /// The cores of nodes that differ from the graph; `None` where none does.
    pub fn cores(&self) -> Option<OwnCores> {
        if self.distortions.is_empty() {
            return self.own.clone();
        }
        let (all, own) = (self.distortions.clone(), self.own.clone());
        Some(Arc::new(move |graph: &Graph, node: &Node, firmness| {
            let here: Vec<Distortion> = all.iter().filter(|d| d.node == node.name).cloned().collect();
            let given = own.as_ref().and_then(|own| own(graph, node, firmness));
            if here.is_empty() {
                return given;
            }
            let cores = given.unwrap_or_else(|| cores_of(graph, &node.name).map_err(|e| e.to_string()));
            Some(cores.map(|cores| wrapped(cores, graph, node, &here)))
        }))
    }

    /// One of its nodes by itself, on its recorded inputs.
    ///
    /// # Errors
    /// A node that cannot be built.
    pub fn alone(&self, name: &str, recorded: &Recorded) -> Result<Vec<PutOut>, AloneError> {
        let own = self.graph.node(name).and_then(|node| self.cores()?(&self.graph, node, 1.0));
        match own {
            Some(Ok(cores)) => alone_with(&self.graph, name, recorded, cores),
            _ => alone(&self.graph, name, recorded),
        }
    }

    /// Runs it at a gain.
    ///
    /// # Errors
    /// As [`Trial::scenario`]; `cancel` was set.
    pub fn run(&self, hand: &Hand, gain: Gain, options: &RunOptions, cancel: &AtomicBool) -> Result<Run, ResimulateError> {
        self.scenario(hand)?.run(gain, options, cancel)
    }

    /// Where it stops being stable, within a factor of 20 of `asked`.
    ///
    /// # Errors
    /// As [`Trial::run`].
    pub fn edge(&self, hand: &Hand, asked: f64, cancel: &AtomicBool) -> Result<Edge, ResimulateError> {
        let search = Search {
            lowest: asked / AROUND,
            floor: asked / (AROUND * AROUND),
            highest: asked * AROUND,
            tolerance: 0.02,
            per_decade: 8,
            whole_grid: false,
            around: false,
        };
        edge(&self.scenario(hand)?, &search, &RunOptions::default(), &|_, _| {}, cancel)
    }

    /// Whether it is stable at a gain with the present hand and with softer and firmer grips.
    ///
    /// # Errors
    /// As [`Trial::run`].
    pub fn holds(&self, hand: &Hand, gain: Gain, firmness: &[f64], cancel: &AtomicBool) -> Result<Vec<Outcome>, ResimulateError> {
        let scenario = self.scenario(hand)?;
        let one = |grip_scale: &f64| {
            scenario.run(gain, &RunOptions { grip_scale: *grip_scale, ..RunOptions::default() }, cancel).map(|run| run.outcome)
        };
        firmness.iter().map(one).collect()
    }
}

fn wrapped(cores: Vec<Box<dyn Core>>, graph: &Graph, node: &Node, distortions: &[Distortion]) -> Vec<Box<dyn Core>> {
    let seed = graph.seed.wrapping_add(u64::from(source_id(&node.name)));
    let around = |(stage, core): (usize, Box<dyn Core>)| -> Box<dyn Core> {
        let here: Vec<Distortion> = distortions.iter().filter(|d| d.stage == stage).cloned().collect();
        if here.is_empty() { core } else { Box::new(Faulty::new(core, &here, graph.period_s(), seed)) }
    };
    cores.into_iter().enumerate().map(around).collect()
}

/// A hand that was recorded step by step, at another rate.
fn at_rate(intent: &Intent, times: f64) -> Intent {
    let Intent::Recorded(rows) = intent else { return intent.clone() };
    if (times - 1.0).abs() < 1e-9 || rows.is_empty() {
        return intent.clone();
    }
    let count = (rows.len() as f64 * times).round() as usize;
    let at = |step: usize| {
        let place = step as f64 / times;
        let (row, share) = (place.floor() as usize, place.fract());
        let here = rows.get(row).or(rows.last()).copied().unwrap_or([0.0, 0.0]);
        let next = rows.get(row + 1).copied().unwrap_or(here);
        [here[0] + share * (next[0] - here[0]), here[1] + share * (next[1] - here[1])]
    };
    Intent::Recorded((0..count.max(1)).map(at).collect())
}
