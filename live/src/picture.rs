//! What a viewer of a run has to be shown beside curves: gains, margin, losses, energy, events.

use crate::scene::Scene;
use backdrive_msgs::topic::Kind;
use backdrive_msgs::{Event, Gains, Margin, Message, Sample, Status, flag, measured};
use backdrive_nodes::build::GraphTopic;
use backdrive_nodes::protocol::MarginStatus;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, VecDeque};

/// Events that are kept for who comes later.
const MOST_EVENTS: usize = 200;

/// Work at a port, and the sample before.
#[derive(Debug, Default)]
struct Port {
    before: Option<Sample>,
    work_j: f64,
}

/// An event in the form that a viewer gets.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Shown {
    /// s since the start of the run.
    pub t: f64,
    pub node: String,
    pub severity: u32,
    pub kind: String,
    pub text: String,
}

/// Gains in force (mu, lambda) and margin.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Known {
    pub gains: Option<(f64, f64)>,
    pub margin: Option<MarginStatus>,
}

/// The state of a run.
#[derive(Debug)]
pub(crate) struct Picture {
    pub rate_hz: f64,
    /// Topics of the master's and the slave's measurements.
    master: Option<String>,
    slave: Option<String>,
    step: u64,
    pub gains: Option<(f64, f64)>,
    pub margin: Option<MarginStatus>,
    is_guarded: bool,
    status: BTreeMap<u32, Status>,
    ports: [Port; 2],
    pub events: VecDeque<Shown>,
    /// Samples that the view did not get, by holes in their sequence numbers.
    pub unseen: u64,
    sequence: Vec<Option<u64>>,
    /// Whether the canceller subtracts.
    pub canceller: bool,
}

impl Picture {
    pub fn of(scene: &Scene, rate_hz: f64, topics: usize) -> Picture {
        let topic = |role: &str| scene.devices.iter().find(|d| d.role == role).map(|d| d.topic.clone());
        Picture {
            rate_hz,
            master: topic("master"),
            slave: topic("slave"),
            step: 0,
            gains: None,
            margin: None,
            is_guarded: false,
            status: BTreeMap::new(),
            ports: [Port::default(), Port::default()],
            events: VecDeque::new(),
            unseen: 0,
            sequence: vec![None; topics],
            canceller: scene.has_canceller,
        }
    }

    /// Takes a message of topic number `index`; an event that is to be shown comes back.
    pub fn take(&mut self, index: usize, topic: &GraphTopic, message: &Message) -> Option<Shown> {
        if topic.topic.kind == Kind::Sample
            && let Some(last) = self.sequence.get_mut(index)
        {
            self.unseen += last.map_or(0, |last| message.sequence().saturating_sub(last + 1));
            *last = Some(message.sequence());
        }
        match message {
            Message::Sample(sample) => self.sample(&topic.topic.name, sample),
            Message::Gains(Gains { mu, lambda, .. }) => self.gains = Some((*mu, *lambda)),
            Message::Margin(margin) => self.margin = Some(of_margin(margin)),
            Message::Status(status) => {
                self.status.insert(status.source, *status);
            }
            Message::Event(event) => return Some(self.event(topic, event)),
        }
        None
    }

    fn event(&mut self, topic: &GraphTopic, event: &Event) -> Shown {
        match event.kind.as_str() {
            "canceller_switched_on" => self.canceller = true,
            "canceller_switched_off" => self.canceller = false,
            _ => {}
        }
        let shown = Shown {
            t: event.step as f64 / self.rate_hz,
            node: topic.publisher.clone(),
            severity: event.severity,
            kind: event.kind.as_str().to_string(),
            text: event.text.as_str().to_string(),
        };
        self.events.push_back(shown.clone());
        self.events.drain(..self.events.len().saturating_sub(MOST_EVENTS));
        shown
    }

    fn sample(&mut self, topic: &str, sample: &Sample) {
        self.step = self.step.max(sample.step);
        if sample.flags & flag::GUARDED != 0 {
            self.is_guarded = true;
        }
        let is = |role: &Option<String>| role.as_deref() == Some(topic);
        // The force of the master is held until its next sample, that of the slave is sampled: the sums of the passivity observer.
        let (port, held) = match (is(&self.master), is(&self.slave)) {
            (true, _) => (&mut self.ports[0], true),
            (_, true) => (&mut self.ports[1], false),
            _ => return,
        };
        if let Some(before) = port.before.replace(*sample).filter(|b| b.step + 1 == sample.step) {
            for axis in 0..sample.len() {
                let force = if held { before.effort[axis] } else { 0.5 * (before.effort[axis] + sample.effort[axis]) };
                let work = -force * (sample.position[axis] - before.position[axis]);
                port.work_j += if work.is_finite() { work } else { 0.0 };
            }
        }
    }

    /// What bounds a change of gains.
    pub fn known(&self) -> Known {
        Known { gains: self.gains, margin: self.margin }
    }

    /// Time of the newest sample, s since the start of the run.
    pub fn time_s(&self) -> f64 {
        self.step as f64 / self.rate_hz
    }

    /// What is shown ten times a second.
    pub fn state(&mut self) -> Value {
        let sum = |of: fn(&Status) -> u64| self.status.values().map(of).sum::<u64>();
        let slowest = self.status.values().max_by(|a, b| a.loop_p99_s.total_cmp(&b.loop_p99_s));
        let has = |role: &Option<String>, port: &Port| role.as_ref().map(|_| port.work_j);
        json!({
            "type": "state",
            "t": self.time_s(),
            "mu": self.gains.map(|g| g.0),
            "lambda": self.gains.map(|g| g.1),
            "guarded": std::mem::take(&mut self.is_guarded),
            "margin": self.margin.map(|m| m.to_string()),
            "factor": self.margin.and_then(|m| m.factor),
            "lost": sum(|s| s.lost),
            "missed": sum(|s| s.missed_deadlines),
            "unseen": self.unseen,
            "p50_us": slowest.map(|s| 1e6 * s.loop_p50_s),
            "p99_us": slowest.map(|s| 1e6 * s.loop_p99_s),
            "work_master_j": has(&self.master, &self.ports[0]),
            "work_slave_j": has(&self.slave, &self.ports[1]),
            "canceller": self.canceller,
        })
    }
}

fn of_margin(margin: &Margin) -> MarginStatus {
    MarginStatus { factor: measured(margin.factor), ..MarginStatus::from(margin) }
}
