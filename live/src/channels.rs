//! The curves of a run: one for each quantity of each axis on each topic of samples, numbered as they are first measured.

use crate::scene::turns;
use backdrive_msgs::topic::Kind;
use backdrive_msgs::{MAX_AXES, Sample};
use backdrive_nodes::build::{GraphTopic, topics};
use backdrive_nodes::graph::Graph;
use serde::Serialize;

/// Position, velocity, effort.
const QUANTITIES: [&str; 3] = ["position", "velocity", "effort"];

/// A curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Channel {
    /// Such as `/master/measured_js`.
    pub topic: String,
    /// The node that sends it, and its kind, such as `master`.
    pub node: String,
    pub kind: &'static str,
    /// Number of the axis, from 0, and its name.
    pub axis: usize,
    pub axis_name: String,
    /// One of `position`, `velocity`, `effort`.
    pub quantity: &'static str,
    /// Unit of the quantity.
    pub unit: &'static str,
}

/// All curves of a run, and where the samples of each topic go.
pub(crate) struct Channels {
    topics: Vec<GraphTopic>,
    nodes: Vec<(&'static str, bool)>,
    /// Per topic, axis and quantity the number of its curve.
    numbers: Vec<[[Option<u16>; 3]; MAX_AXES]>,
    known: Vec<Channel>,
}

impl Channels {
    /// Of a graph: no curve is known before something is measured.
    pub fn of(graph: &Graph) -> Channels {
        let topics = topics(graph);
        let node = |t: &GraphTopic| graph.node(&t.publisher);
        let nodes = topics.iter().map(|t| node(t).map_or(("other", false), |n| (n.kind.name(), turns(graph, n)))).collect();
        let numbers = vec![[[None; 3]; MAX_AXES]; topics.len()];
        Channels { topics, nodes, numbers, known: Vec::new() }
    }

    /// The topics of the run, by whose places samples are given.
    pub fn topics(&self) -> &[GraphTopic] {
        &self.topics
    }

    /// The curves that are known, by their numbers.
    pub fn known(&self) -> &[Channel] {
        &self.known
    }

    /// Gives every measured value of a sample to its curve: `take(number, value)`. What is not finite is no value.
    pub fn each(&mut self, topic: usize, sample: &Sample, mut take: impl FnMut(u16, f64)) {
        if self.topics.get(topic).is_none_or(|t| t.topic.kind != Kind::Sample) {
            return;
        }
        for axis in 0..sample.len() {
            for (quantity, value) in [sample.position[axis], sample.velocity[axis], sample.effort[axis]].into_iter().enumerate() {
                if value.is_finite() {
                    let number = match self.numbers[topic][axis][quantity] {
                        Some(number) => number,
                        None => self.add(topic, axis, quantity),
                    };
                    take(number, value);
                }
            }
        }
    }

    fn add(&mut self, topic: usize, axis: usize, quantity: usize) -> u16 {
        let number = self.known.len() as u16;
        let GraphTopic { topic: name, publisher, axes, .. } = &self.topics[topic];
        let (kind, turns) = self.nodes[topic];
        let unit = match (quantity, turns) {
            (0, false) => "m",
            (0, true) => "rad",
            (1, false) => "m/s",
            (1, true) => "rad/s",
            (_, false) => "N",
            (_, true) => "N m",
        };
        let axis_name = axes.get(axis).cloned().unwrap_or_else(|| format!("axis {axis}"));
        let (topic_name, node, quantity_name) = (name.name.clone(), publisher.clone(), QUANTITIES[quantity]);
        self.known.push(Channel { topic: topic_name, node, kind, axis, axis_name, quantity: quantity_name, unit });
        self.numbers[topic][axis][quantity] = Some(number);
        number
    }
}
