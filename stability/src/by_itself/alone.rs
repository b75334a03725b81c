//! One node by itself: what it would have put out of what the bag says it was given.
//!
//! Where every node does of its recorded inputs what its recorded outputs show, nothing is hidden in the loop. Where one does not, that
//! node, or the way to it, is what differs from the graph: so a fault is located before it is named. A node is run open loop, for a closed
//! loop that is stable hides what its parts do wrong, and one that is not multiplies it.

use super::recorded::{Recorded, Track};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Gains, Sample};
use backdrive_nodes::build::{BuildError, plan};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::sequence::{Sequence, SequenceError};
use backdrive_nodes::stage::{NodePlan, OutputPort, Stage};

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

/// Plays recorded samples, one per step.
struct Player {
    track: Option<Track>,
}

impl Core for Player {
    fn step(&mut self, tick: &Tick, _: &[Port], outputs: &mut [Sample], _: &mut Events) {
        let sample = self.track.as_ref().and_then(|t| t.sample(tick.step as usize));
        if let (Some(sample), Some(output)) = (sample, outputs.first_mut()) {
            *output = sample;
        }
    }
}

/// Runs the node `name` of a graph on the recorded samples of its inputs, with the delays and impairments that the graph has on the ways to it.
///
/// # Errors
/// A node that cannot be built, such as one that only the user's own program knows.
pub fn alone(graph: &Graph, name: &str, recorded: &Recorded) -> Result<Vec<PutOut>, AloneError> {
    alone_at(graph, name, recorded, &[])
}

/// The same with gains in force from their steps on, in order, in the place of what the graph plans.
///
/// # Errors
/// As [`alone`].
pub fn alone_at(graph: &Graph, name: &str, recorded: &Recorded, gains: &[Gains]) -> Result<Vec<PutOut>, AloneError> {
    let node = plan(graph, name)?;
    let side = |part: &str| Topic { name: format!("/recorded/{part}"), kind: Kind::Event };
    let mut inputs: Vec<Topic> = Vec::new();
    for port in node.stages.iter().flat_map(|s| &s.inputs) {
        if !inputs.contains(&port.topic) && !is_own(&node, &port.topic) && port.name != backdrive_nodes::stage::PACE_PORT {
            inputs.push(port.topic.clone());
        }
    }
    let stages = inputs.into_iter().map(|topic| {
        let track = recorded.track(&topic.name).cloned();
        let axes = track.as_ref().map_or(1, Track::axes);
        let output = OutputPort { name: topic.name.clone(), topic, axes };
        Stage { name: output.name.clone(), inputs: Vec::new(), outputs: vec![output], core: Box::new(Player { track }) }
    });
    let players = NodePlan {
        name: "recorded".to_string(),
        stages: stages.collect(),
        events: side("events"),
        status: side("status"),
        gains_in: None,
        gains_out: None,
        margin_out: None,
    };
    let outputs: Vec<String> = node.stages.iter().flat_map(|s| &s.outputs).map(|o| o.topic.name.clone()).collect();
    let mut sequence = Sequence::new(vec![players, node], &graph.timing)?;
    let numbers: Vec<(String, usize)> = outputs.into_iter().filter_map(|o| sequence.sample_topic(&o).map(|n| (o, n))).collect();
    let mut put: Vec<PutOut> =
        numbers.iter().map(|(topic, _)| PutOut { topic: topic.clone(), samples: Vec::with_capacity(recorded.rows) }).collect();
    let mut gains = gains.iter().peekable();
    for row in 0..recorded.rows {
        let now = recorded.first + row as u64;
        while let Some(due) = gains.next_if(|due| due.step <= now) {
            sequence.set_gains(Gains { step: row as u64, ramp_s: 0.0, ..*due });
        }
        sequence.step(None);
        for ((_, number), put) in numbers.iter().zip(&mut put) {
            put.samples.extend(sequence.sample(*number).copied());
        }
    }
    Ok(put)
}

fn is_own(node: &NodePlan, topic: &Topic) -> bool {
    node.stages.iter().flat_map(|s| &s.outputs).any(|o| o.topic == *topic)
}
