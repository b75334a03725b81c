//! A loop with a script, ready to be run at any gain.

use super::types::{Gain, ResimulateError, Run, RunOptions};
use crate::collect::{Collector, Signal};
use crate::judgement::{frequency_hz, judge};
use crate::outcome::{Outcome, Trace};
use crate::resimulate::grip;
use crate::unjudged::Unjudged;
use backdrive_control::core::Core;
use backdrive_control::operator::Intent;
use backdrive_nodes::build::{plan, plan_with};
use backdrive_nodes::graph::{Graph, Node, NodeKind, Settings};
use backdrive_nodes::sequence::Sequence;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Steps between checks whether to end early.
const CHUNK: u64 = 256;

/// Makes the cores of a node that is a user's own program, new for each run; the number scales the grip's forces. `None`: the node of the graph is
/// used.
pub type OwnCores = Arc<dyn Fn(&Graph, &Node, f64) -> Option<Result<Vec<Box<dyn Core>>, String>> + Send + Sync>;

/// A loop with a script, ready to be run at any gain.
#[derive(Clone)]
pub struct Scenario {
    pub(super) graph: Graph,
    pub(super) steps: u64,
    pub(super) script: String,
    own: Option<OwnCores>,
}

impl std::fmt::Debug for Scenario {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scenario").field("script", &self.script).field("steps", &self.steps).finish_non_exhaustive()
    }
}

impl Scenario {
    /// Of a graph that already contains the command line's changes, moved by `intents` (one per axis) for `steps` steps. Without intents the graph's
    /// own operator moves it, and without steps it runs for the duration in the graph.
    ///
    /// Scheduled changes of the gains are removed, and the guard is off.
    ///
    /// # Errors
    /// A graph without a closed loop or an operator, or with a node that only the user's own program knows; no length.
    pub fn new(mut graph: Graph, intents: Option<Vec<Intent>>, steps: Option<u64>) -> Result<Scenario, ResimulateError> {
        let name = graph.path.display().to_string();
        for kind in [NodeKind::Master, NodeKind::Scaling, NodeKind::Slave] {
            let there = if kind.closes_loop() { graph.loop_node().is_some() } else { graph.node_of(kind).is_some() };
            if !there {
                return Err(ResimulateError::NoLoop { graph: name, kind: kind.name() });
            }
        }
        let Some(operator) = graph.nodes.iter().position(|n| n.kind == NodeKind::Operator) else {
            return Err(ResimulateError::NoOperator { graph: name });
        };
        for node in graph.nodes.iter().filter(|n| n.command.is_some()) {
            let option = match &node.settings {
                Settings::Master(files) if files.model.is_none() => "--master",
                Settings::Slave(files) if files.model.is_none() => "--slave",
                Settings::Canceller(..) => "--canceller",
                Settings::Scaling { .. } | Settings::Coupling { .. } => continue,
                Settings::Operator(_) if intents.is_none() => "--script",
                _ => continue,
            };
            return Err(ResimulateError::OwnProgram { node: node.name.clone(), option });
        }
        let steps = steps.or(graph.timing.steps).ok_or(ResimulateError::NoLength { graph: name })?;
        let script = if intents.is_some() { "the recorded hand" } else { "the graph's operator" };
        if let Some(intents) = intents {
            graph.nodes[operator].settings = Settings::Operator(intents);
        }
        graph.gains.changes.clear();
        graph.timing.steps = Some(steps);
        graph.bag = None;
        for node in &mut graph.nodes {
            if let Settings::Scaling { guard, .. } = &mut node.settings {
                *guard = false;
            }
        }
        let scenario = Scenario { graph, steps, script: script.to_string(), own: None };
        // A part that cannot be built is reported now, not in the middle of a sweep.
        scenario.sequence(&scenario.graph, 1.0)?;
        Ok(scenario)
    }

    /// The same with the caller's own cores instead of some nodes: a device that is not simulated here.
    pub fn with_own_cores(mut self, own: OwnCores) -> Scenario {
        self.own = Some(own);
        self
    }

    /// The graph that is run.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// What the hand does, for the report: the stability limit holds for this script.
    pub fn script(&self) -> &str {
        &self.script
    }

    /// Length of a run, s.
    pub fn duration_s(&self) -> f64 {
        self.steps as f64 * self.graph.period_s()
    }

    /// The gain in the graph.
    pub fn own_gain(&self) -> Gain {
        Gain { mu: self.graph.gains.mu, lambda: self.graph.gains.lambda }
    }

    /// The gain whose product is `product`, reached by lambda at the graph's mu.
    pub fn gain(&self, product: f64) -> Gain {
        Gain { mu: self.graph.gains.mu, lambda: product / self.graph.gains.mu }
    }

    /// The same without a canceller.
    pub fn without_canceller(&self) -> Scenario {
        let mut scenario = self.clone();
        for node in &mut scenario.graph.nodes {
            if let Settings::Canceller(files, ..) = &mut node.settings {
                files.model = None;
            }
        }
        scenario
    }

    /// Runs it. The gain is constant from the start; the run ends early where the master leaves all bounds.
    ///
    /// # Errors
    /// A gain that is none; a model that cannot be stepped; `cancel` was set.
    pub fn run(&self, gain: Gain, options: &RunOptions, cancel: &AtomicBool) -> Result<Run, ResimulateError> {
        if !(gain.mu.is_finite() && gain.lambda.is_finite()) {
            return Err(ResimulateError::Gain { mu: gain.mu, lambda: gain.lambda });
        }
        let mut graph = self.graph.clone();
        (graph.gains.mu, graph.gains.lambda) = (gain.mu, gain.lambda);
        graph.seed = options.seed.unwrap_or(graph.seed);
        for node in &mut graph.nodes {
            match &mut node.settings {
                Settings::Scaling { dither, .. } if !options.keep_dither => dither.clear(),
                Settings::Master(files) if options.grip_scale != 1.0 => {
                    if let Some(grip) = &mut files.fragment {
                        grip::scale(grip, options.grip_scale);
                    }
                }
                _ => {}
            }
        }
        let mut sequence = self.sequence(&graph, options.grip_scale)?;
        let mut collector = Collector::of(&graph, &self.graph.path.display().to_string());
        collector.reserve(self.steps as usize);
        let needed = |signal: Signal| match signal {
            Signal::Intent | Signal::Master | Signal::Slave => true,
            Signal::Dither => options.keep_signals || options.keep_dither,
            Signal::Induced | Signal::Command => options.keep_signals,
        };
        let topics: Vec<(usize, Signal)> = collector
            .topics()
            .iter()
            .filter(|(_, signal)| needed(*signal))
            .filter_map(|(name, signal)| Some((sequence.sample_topic(name)?, *signal)))
            .collect();
        while sequence.steps() < self.steps {
            if cancel.load(Ordering::Relaxed) {
                return Err(ResimulateError::Cancelled);
            }
            for _ in 0..CHUNK.min(self.steps - sequence.steps()) {
                sequence.step(None);
                for (topic, signal) in &topics {
                    if let Some(sample) = sequence.sample(*topic) {
                        collector.hear(*signal, sample);
                    }
                }
            }
            // Beyond all bounds the verdict is unstable whatever follows.
            if collector.ran_away() {
                break;
            }
        }
        let traces = collector.traces();
        let outcomes: Vec<Outcome> = traces.iter().map(judge).collect();
        let outcome = Outcome::worst(outcomes.iter().copied()).unwrap_or(Outcome::NotJudged { why: Unjudged::Empty });
        let rough = traces.iter().zip(&outcomes).max_by_key(|(_, outcome)| outcome.rank());
        let frequency_hz = rough.filter(|_| !outcome.is_stable()).map(|(trace, _)| frequency_hz(trace));
        let unclamped = |t: Trace| Trace { clamped: Vec::new(), travel: None, ..t };
        let (contact_s, judged_s) = contact(&traces);
        let beneath = match outcome {
            Outcome::Limited { .. } => Outcome::worst(traces.into_iter().map(|t| judge(&unclamped(t)))).unwrap_or(outcome),
            other => other,
        };
        let signals = options.keep_signals.then(|| collector.session());
        Ok(Run { gain, outcome, beneath, frequency_hz, contact_s, judged_s, steps: sequence.steps(), signals })
    }

    fn sequence(&self, graph: &Graph, grip_scale: f64) -> Result<Sequence, ResimulateError> {
        let planned = |node: &Node| match self.own.as_ref().and_then(|own| own(graph, node, grip_scale)) {
            Some(Ok(cores)) => Ok(plan_with(graph, &node.name, cores)?),
            Some(Err(why)) => Err(ResimulateError::Own { node: node.name.clone(), why }),
            None => Ok(plan(graph, &node.name)?),
        };
        let nodes = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder);
        let plans = nodes.map(planned).collect::<Result<Vec<_>, ResimulateError>>()?;
        Ok(Sequence::new(plans, &graph.timing)?)
    }
}

/// Time in contact, and of it the time in which the hand held still, s.
fn contact(traces: &[Trace]) -> (f64, f64) {
    let steps = traces.iter().map(|t| t.contact.len()).max().unwrap_or(0);
    let period_s = traces.first().map_or(0.0, |t| t.period_s);
    let touches = |step: usize| traces.iter().any(|t| t.contact.get(step).is_some_and(|f| *f != 0.0));
    let still = |step: usize| traces.iter().all(|t| step == 0 || t.intent.get(step).is_none_or(|x| *x == t.intent[step - 1]));
    let (mut touching, mut judged) = (0, 0);
    for step in (0..steps).filter(|s| touches(*s)) {
        touching += 1;
        judged += usize::from(still(step));
    }
    (touching as f64 * period_s, judged as f64 * period_s)
}
