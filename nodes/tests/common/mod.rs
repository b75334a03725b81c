//! A toy teleoperator: five nodes around a loop with one step of delay, whose numbers are chaotic
//! enough that any sample out of place shows in all that follow.
#![allow(dead_code)]

use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Gains, Message, Sample};
use backdrive_nodes::recorder::{RecorderPlan, Sink};
use backdrive_nodes::runner::RunError;
use backdrive_nodes::stage::{Clock, Impairment, InputPort, NodePlan, OutputPort, PACE_PORT, Stage, Timing};
use std::sync::{Arc, Mutex};

pub const CREDIT: &str = "/recorder/credit";

pub fn topic(name: &str) -> Topic {
    Topic { name: name.to_string(), kind: Kind::Sample }
}

pub fn timing(clock: Clock, rate_hz: f64, steps: Option<u64>) -> Timing {
    Timing { rate_hz, clock, steps, peer_timeout_s: 10.0 }
}

/// A logistic map driven by the inputs, with a gain that can be changed.
pub struct Toy {
    state: f64,
    gain: f64,
    has_gains: bool,
}

impl Toy {
    pub fn new(seed: f64) -> Toy {
        Toy { state: seed, gain: 1.0, has_gains: false }
    }

    pub fn with_gains(seed: f64) -> Toy {
        Toy { has_gains: true, ..Toy::new(seed) }
    }
}

impl Core for Toy {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let held = inputs.iter().filter_map(|p| p.sample).map(|s| s.position[0]).sum::<f64>();
        let ages = inputs.iter().map(|p| p.age_steps as f64).sum::<f64>();
        self.state = (3.7 * self.state * (1.0 - self.state) + 0.01 * (self.gain * held + 0.1 * ages).sin()).clamp(0.0, 1.0);
        for (i, output) in outputs.iter_mut().enumerate() {
            output.position[0] = self.state + i as f64;
            output.effort[0] = -self.state;
        }
        if tick.step % 997 == 3 {
            events.push("toy_event", self.state, 0);
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        self.gain = gains.lambda;
    }

    fn gains(&self) -> Option<(f64, f64)> {
        self.has_gains.then_some((1.0, self.gain))
    }
}

pub fn input(name: &str, from: &str, delay: u64) -> InputPort {
    InputPort { name: name.to_string(), topic: topic(from), delay, impairment: None }
}

pub fn stage(name: &str, core: impl Core + 'static, inputs: Vec<InputPort>, outputs: &[&str]) -> Stage {
    let outputs = outputs.iter().map(|o| OutputPort { name: "out".into(), topic: topic(o), axes: 1 }).collect();
    Stage { name: name.to_string(), inputs, outputs, core: Box::new(core) }
}

pub fn node(name: &str, stages: Vec<Stage>) -> NodePlan {
    let side = |part: &str, kind| Topic { name: format!("/{name}/{part}"), kind };
    let has_gains = name == "scaling";
    NodePlan {
        name: name.to_string(),
        stages,
        events: side("events", Kind::Event),
        status: side("status", Kind::Status),
        gains_in: None,
        gains_out: has_gains.then(|| side("gains", Kind::Gains)),
        lists: Vec::new(),
        margin_out: None,
    }
}

pub const NODES: [&str; 5] = ["operator", "master", "canceller", "scaling", "slave"];

/// The five nodes; with `credit`, the operator waits for the recorder.
pub fn plans(impairment: Option<Impairment>, credit: bool) -> Vec<NodePlan> {
    let mut pace = vec![];
    if credit {
        pace.push(InputPort { name: PACE_PORT.into(), topic: topic(CREDIT), delay: 1024, impairment: None });
    }
    let impaired = |port: InputPort| InputPort { impairment, ..port };
    vec![
        node("operator", vec![stage("operator", Toy::new(0.31), pace, &["/operator/intent"])]),
        node(
            "master",
            vec![stage("master", Toy::new(0.41), vec![input("hand", "/operator/intent", 0), input("force", "/force", 1)], &["/master/js"])],
        ),
        node(
            "canceller",
            vec![stage("canceller", Toy::new(0.51), vec![input("motion", "/master/js", 0), input("force", "/force", 1)], &["/cancelled"])],
        ),
        node(
            "scaling",
            vec![
                stage("forward", Toy::new(0.61), vec![input("motion", "/cancelled", 0)], &["/command"]),
                stage(
                    "backward",
                    Toy::with_gains(0.71),
                    vec![impaired(input("contact", "/contact", 0)), input("motion", "/master/js", 7)],
                    &["/force", "/dither"],
                ),
            ],
        ),
        node("slave", vec![stage("slave", Toy::new(0.81), vec![impaired(input("command", "/command", 0))], &["/contact"])]),
    ]
}

pub fn recorder_plan() -> RecorderPlan {
    let mut topics = Vec::new();
    for plan in plans(None, false) {
        topics.extend(plan.stages.iter().flat_map(|s| &s.outputs).map(|o| o.topic.clone()));
        topics.extend([plan.events, plan.status]);
        topics.extend(plan.gains_out);
    }
    RecorderPlan { name: "recorder".into(), topics, credit: Some((topic(CREDIT), 1)), by_wall_clock: false }
}

/// How many listeners each topic has, the recorder included where there is one.
pub fn listeners(recorded: bool) -> std::collections::BTreeMap<String, usize> {
    let mut map = std::collections::BTreeMap::new();
    for plan in plans(None, false) {
        for port in plan.stages.iter().flat_map(|s| &s.inputs) {
            *map.entry(port.topic.name.clone()).or_insert(0) += 1;
        }
    }
    if recorded {
        for topic in recorder_plan().topics {
            *map.entry(topic.name).or_insert(0) += 1;
        }
    }
    map
}

/// Every message, per topic, with all of its bits.
pub type Heard = Vec<Vec<String>>;

/// Bits of a message, for comparison.
pub fn bits(message: &Message) -> String {
    match message {
        Message::Sample(s) => {
            let p: Vec<u64> = s.position.iter().chain(&s.velocity).chain(&s.effort).map(|x| x.to_bits()).collect();
            format!("{} {} {} {} {} {p:x?}", s.source, s.step, s.sequence, s.stamp_ns, s.axes)
        }
        other => format!("{other:?}"),
    }
}

/// A sink that keeps everything, and counts holes.
pub struct Keeping {
    pub heard: Arc<Mutex<Heard>>,
    pub next: Vec<u64>,
    pub lost: u64,
    pub written: u64,
}

impl Keeping {
    pub fn new(topics: usize) -> (Keeping, Arc<Mutex<Heard>>) {
        let heard = Arc::new(Mutex::new(vec![Vec::new(); topics]));
        (Keeping { heard: Arc::clone(&heard), next: vec![0; topics], lost: 0, written: 0 }, heard)
    }
}

impl Sink for Keeping {
    fn push(&mut self, topic: usize, message: Message, _receive_ns: i64) -> Result<(), RunError> {
        self.lost += message.sequence().saturating_sub(self.next[topic]);
        self.next[topic] = message.sequence() + 1;
        self.written += 1;
        self.heard.lock().unwrap()[topic].push(bits(&message));
        Ok(())
    }

    fn health(&self) -> (u64, u64, u64) {
        (self.written, 0, self.lost)
    }

    fn finish(self: Box<Self>) -> Result<backdrive_bags::Completeness, RunError> {
        assert_eq!(self.lost, 0);
        Ok(backdrive_bags::Completeness::default())
    }
}
