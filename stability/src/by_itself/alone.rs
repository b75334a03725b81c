//! One node by itself: the output that it would have computed from its recorded inputs.
//!
//! Where every node does of its recorded inputs what its recorded outputs show, nothing is hidden in the loop. Where one does not, that
//! node, or the way to it, is what differs from the graph: so a fault is located before it is named. A node is run open loop, for a closed
//! loop that is stable hides what its parts do wrong, and one that is not multiplies it.

use super::recorded::{Recorded, Track};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Gains, Sample};
use backdrive_nodes::build::{BuildError, plan, plan_with};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::sequence::{Sequence, SequenceError};
use backdrive_nodes::stage::{NodePlan, OutputPort, Stage};
use std::sync::{Arc, Mutex};

/// Why a node cannot be run by itself.
#[derive(Debug, thiserror::Error)]
pub enum AloneError {
    /// It cannot be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// It cannot be joined to the recording.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
}

/// What a node puts out on a topic, one sample per row.
#[derive(Debug, Clone)]
pub struct PutOut {
    /// The topic.
    pub topic: String,
    /// One per row.
    pub samples: Vec<Sample>,
}

/// Recorded samples that are played, and the step of the first of them.
#[derive(Default)]
struct Reel {
    track: Option<Track>,
    first: u64,
}

/// Plays recorded samples, one per step.
struct Player {
    reel: Arc<Mutex<Reel>>,
}

impl Core for Player {
    fn step(&mut self, tick: &Tick, _: &[Port], outputs: &mut [Sample], _: &mut Events) {
        let Ok(reel) = self.reel.lock() else { return };
        let row = tick.step.checked_sub(reel.first);
        let sample = reel.track.as_ref().zip(row).and_then(|(track, row)| track.sample(row as usize));
        if let (Some(sample), Some(output)) = (sample, outputs.first_mut()) {
            *output = sample;
        }
    }
}

/// A node by itself, fed window by window: what it remembers stays from one to the next.
pub(crate) struct Alone {
    sequence: Sequence,
    reels: Vec<(String, Arc<Mutex<Reel>>)>,
    /// Its outputs, with their numbers in the sequence.
    outputs: Vec<(String, usize)>,
    /// Rows that it has done.
    rows: u64,
    /// Gains that it has been given.
    given: usize,
}

impl Alone {
    /// Joins a node to players. `recorded` has the number of axes of each input.
    pub(crate) fn new(graph: &Graph, name: &str, recorded: &Recorded) -> Result<Alone, AloneError> {
        Alone::of(plan(graph, name)?, graph, recorded)
    }

    fn of(node: NodePlan, graph: &Graph, recorded: &Recorded) -> Result<Alone, AloneError> {
        let side = |part: &str| Topic { name: format!("/recorded/{part}"), kind: Kind::Event };
        let mut inputs: Vec<Topic> = Vec::new();
        for port in node.stages.iter().flat_map(|s| &s.inputs) {
            if !inputs.contains(&port.topic) && !is_own(&node, &port.topic) && port.name != backdrive_nodes::stage::PACE_PORT {
                inputs.push(port.topic.clone());
            }
        }
        let reels: Vec<(String, Arc<Mutex<Reel>>)> = inputs.iter().map(|topic| (topic.name.clone(), Arc::default())).collect();
        let stages = inputs.into_iter().zip(&reels).map(|(topic, (_, reel))| {
            let axes = recorded.track(&topic.name).map_or(1, Track::axes);
            let output = OutputPort { name: topic.name.clone(), topic, axes };
            let core = Box::new(Player { reel: Arc::clone(reel) });
            Stage { name: output.name.clone(), inputs: Vec::new(), outputs: vec![output], core }
        });
        let players = NodePlan {
            name: "recorded".to_string(),
            stages: stages.collect(),
            events: side("events"),
            status: side("status"),
            gains_in: None,
            gains_out: None,
            margin_out: None,
            lists: Vec::new(),
        };
        let outputs: Vec<String> = node.stages.iter().flat_map(|s| &s.outputs).map(|o| o.topic.name.clone()).collect();
        let sequence = Sequence::new(vec![players, node], &graph.timing)?;
        let outputs = outputs.into_iter().filter_map(|o| sequence.sample_topic(&o).map(|number| (o, number))).collect();
        Ok(Alone { sequence, reels, outputs, rows: 0, given: 0 })
    }

    /// The rows that follow those before. `origin`: step of the recording's first row; `gains`: in force from their steps on, in order.
    pub(crate) fn run(&mut self, recorded: &Recorded, origin: u64, gains: &[Gains]) -> Vec<PutOut> {
        for (topic, reel) in &self.reels {
            if let Ok(mut reel) = reel.lock() {
                *reel = Reel { track: recorded.track(topic).cloned(), first: self.rows };
            }
        }
        let samples = || Vec::with_capacity(recorded.rows);
        let mut put: Vec<PutOut> = self.outputs.iter().map(|(topic, _)| PutOut { topic: topic.clone(), samples: samples() }).collect();
        for _ in 0..recorded.rows {
            while let Some(due) = gains.get(self.given).filter(|due| due.step <= origin + self.rows) {
                self.sequence.set_gains(Gains { step: self.rows, ramp_s: 0.0, ..*due });
                self.given += 1;
            }
            self.sequence.step(None);
            self.rows += 1;
            for ((_, number), put) in self.outputs.iter().zip(&mut put) {
                put.samples.extend(self.sequence.sample(*number).copied());
            }
        }
        put
    }
}

/// Runs the node `name` of a graph on the recorded samples of its inputs, with the delays and impairments that the graph has on the ways to it.
///
/// # Errors
/// A node that cannot be built, such as one that only the user's own program knows.
pub fn alone(graph: &Graph, name: &str, recorded: &Recorded) -> Result<Vec<PutOut>, AloneError> {
    Ok(Alone::new(graph, name, recorded)?.run(recorded, recorded.first, &[]))
}

/// The same of a node whose cores the caller brings, one per stage.
///
/// # Errors
/// As [`alone`]; another number of cores than the node has stages.
pub fn alone_with(graph: &Graph, name: &str, recorded: &Recorded, cores: Vec<Box<dyn Core>>) -> Result<Vec<PutOut>, AloneError> {
    Ok(Alone::of(plan_with(graph, name, cores)?, graph, recorded)?.run(recorded, recorded.first, &[]))
}

fn is_own(node: &NodePlan, topic: &Topic) -> bool {
    node.stages.iter().flat_map(|s| &s.outputs).any(|o| o.topic == *topic)
}
