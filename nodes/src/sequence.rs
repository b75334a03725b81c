//! All nodes of a graph in one thread, in lockstep: what a sweep and a re-simulation run.
//!
//! Stages step one after the other in an order that follows the connections without delay, and read each
//! other's outputs where they lie; only connections with a delay keep a ring of past samples. Steps,
//! sequence numbers, stamps, impairments, events, gains and status are those of the processes, bit for bit.

use crate::book::{Book, Health, Wanted, gains_are_valid};
use crate::impair::Line;
use crate::input::age;
use crate::stage::{Clock, InputPort, NodePlan, PACE_PORT, Timing};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::topic::Topic;
use backdrive_msgs::{Gains, LAYOUT, Message, Sample};
use std::ops::Range;

/// Why a graph cannot run in one thread.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SequenceError {
    /// An input's topic has no publisher.
    #[error("node `{node}`: no node publishes {topic}")]
    NoPublisher {
        /// Who listens.
        node: String,
        /// To what.
        topic: String,
    },
    /// Two outputs speak on one topic.
    #[error("{0} has two publishers")]
    TwoPublishers(String),
    /// Stages wait for each other.
    #[error("{} wait for each other: one connection on the way must have a delay", .0.join(", "))]
    Loop(Vec<String>),
    /// A rate that is no rate.
    #[error("a rate of {0} Hz is not possible")]
    Rate(String),
}

/// Where an input's sample comes from.
enum Source {
    /// The output slot holds the sample of this step already.
    Slot(usize),
    /// The output slot still holds the sample of the step before.
    SlotBefore(usize),
    /// A ring of past samples, this many steps ago.
    Ring(usize, u64),
}

struct Input {
    source: Source,
    lag: u64,
    /// Boxed: few inputs have one, and the others should lie close together.
    line: Option<Box<Line>>,
}

/// Past samples of an output; the length is a power of two greater than any delay on it.
struct Ring {
    slot: usize,
    samples: Vec<Sample>,
}

struct Stage {
    node: usize,
    is_first: bool,
    inputs: Vec<Input>,
    ports: Vec<Port>,
    slots: Range<usize>,
    rings: Range<usize>,
    core: Box<dyn Core>,
    wanted: Wanted,
}

struct Node {
    book: Book,
    events: usize,
    status: usize,
    gains: Option<usize>,
    margin: Option<usize>,
}

/// A graph that runs in the calling thread.
pub struct Sequence {
    rate_hz: f64,
    step: u64,
    stages: Vec<Stage>,
    nodes: Vec<Node>,
    /// The outputs of all stages, one after the other.
    samples: Vec<Sample>,
    /// What each of them is before its core fills it.
    blank: Vec<Sample>,
    rings: Vec<Ring>,
    topics: Vec<Topic>,
    noted: Events,
}

/// Hears every message: the number of its topic in [`Sequence::topics`], and the message.
pub type Tap<'a> = &'a mut dyn FnMut(usize, &Message);

impl Sequence {
    /// Joins the nodes of a graph. Of `timing` only the rate counts.
    ///
    /// # Errors
    /// An input without publisher, a topic with two, or stages that wait for each other.
    pub fn new(plans: Vec<NodePlan>, timing: &Timing) -> Result<Sequence, SequenceError> {
        let rate_hz = timing.rate_hz;
        if !(rate_hz.is_finite() && rate_hz > 0.0) {
            return Err(SequenceError::Rate(rate_hz.to_string()));
        }
        let order = order(&plans)?;
        let lockstep = Timing { clock: Clock::Lockstep, ..timing.clone() };
        let mut topics = Vec::new();
        let mut axes = Vec::new();
        for place in &order {
            for output in &plans[place.node].stages[place.stage].outputs {
                topics.push(output.topic.clone());
                axes.push(output.axes);
            }
        }
        let mut nodes = Vec::new();
        for plan in &plans {
            let mut number = |topic: &Topic| {
                topics.push(topic.clone());
                topics.len() - 1
            };
            let (events, status) = (number(&plan.events), number(&plan.status));
            let gains = plan.gains_out.as_ref().map(&mut number);
            let margin = plan.margin_out.as_ref().map(&mut number);
            nodes.push(Node { book: Book::new(&plan.name, &lockstep), events, status, gains, margin });
        }
        let slot_of = |topic: &Topic| topics[..axes.len()].iter().position(|t| t.name == topic.name);

        // How far back any reader looks at each output.
        let mut depth = vec![0; axes.len()];
        let (mut wired, mut first_slot) = (Vec::new(), 0);
        for place in &order {
            let node = &plans[place.node];
            let stage = &node.stages[place.stage];
            let mut sources = Vec::new();
            for port in seen(&stage.inputs) {
                let absent = || SequenceError::NoPublisher { node: node.name.clone(), topic: port.topic.name.clone() };
                let slot = slot_of(&port.topic).ok_or_else(absent)?;
                sources.push(match port.delay {
                    0 => Source::Slot(slot),
                    1 if slot >= first_slot => Source::SlotBefore(slot),
                    delay => {
                        depth[slot] = delay.max(depth[slot]);
                        Source::Ring(slot, delay)
                    }
                });
            }
            first_slot += stage.outputs.len();
            wired.push(sources);
        }
        let mut rings = Vec::new();
        let ring_of: Vec<usize> = depth
            .iter()
            .enumerate()
            .map(|(slot, depth)| {
                if *depth > 0 {
                    rings.push(Ring { slot, samples: vec![Sample::new(0); (*depth as usize + 1).next_power_of_two()] });
                }
                rings.len() - usize::from(*depth > 0)
            })
            .collect();

        let mut cores: Vec<Vec<Option<crate::stage::Stage>>> =
            plans.into_iter().map(|p| p.stages.into_iter().map(Some).collect()).collect();
        let (mut stages, mut first_slot) = (Vec::new(), 0);
        for (place, sources) in order.iter().zip(wired) {
            let Some(stage) = cores[place.node][place.stage].take() else { continue };
            let slots = first_slot..first_slot + stage.outputs.len();
            first_slot = slots.end;
            let inputs = seen(&stage.inputs).zip(sources).map(|(port, source)| {
                let line = port.impairment.as_ref().map(|i| Box::new(Line::new(i, rate_hz)));
                let lag = port.delay + line.as_ref().map_or(0, |l| l.delay);
                let source = if let Source::Ring(slot, delay) = source { Source::Ring(ring_of[slot], delay) } else { source };
                Input { source, lag, line }
            });
            let inputs: Vec<Input> = inputs.collect();
            let own = |ring: &Ring| slots.contains(&ring.slot);
            let first_ring = rings.iter().position(own).unwrap_or(0);
            stages.push(Stage {
                node: place.node,
                is_first: place.stage == 0,
                ports: vec![Port::EMPTY; inputs.len()],
                inputs,
                rings: first_ring..first_ring + rings.iter().filter(|r| own(r)).count(),
                slots,
                core: stage.core,
                wanted: Wanted::default(),
            });
        }
        let mut blank: Vec<Sample> = axes.iter().map(|a| Sample::new(*a)).collect();
        for stage in &stages {
            let source = nodes[stage.node].book.source;
            blank[stage.slots.clone()].iter_mut().for_each(|s| (s.layout, s.source) = (LAYOUT, source));
        }
        Ok(Sequence { rate_hz, step: 0, stages, nodes, samples: blank.clone(), blank, rings, topics, noted: Events::default() })
    }

    /// All topics, in the order of the numbers that a [`Tap`] hears: first those of samples.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Number of the sample topic with this name, for [`Sequence::sample`].
    pub fn sample_topic(&self, name: &str) -> Option<usize> {
        self.topics[..self.samples.len()].iter().position(|t| t.name == name)
    }

    /// The newest sample of a sample topic, by its number.
    pub fn sample(&self, topic: usize) -> Option<&Sample> {
        self.samples.get(topic)
    }

    /// Steps done.
    pub fn steps(&self) -> u64 {
        self.step
    }

    /// Wants other gains from step `gains.step` on. Gains that are no numbers are ignored, as in a process.
    pub fn set_gains(&mut self, gains: Gains) {
        if gains_are_valid(&gains) {
            self.stages.iter_mut().for_each(|s| s.wanted.push(gains));
        }
    }

    /// Does `steps` steps; whoever taps hears every message.
    pub fn run(&mut self, steps: u64, mut tap: Option<Tap>) {
        for _ in 0..steps {
            self.step(tap.as_mut().map(|t| &mut **t as Tap));
        }
    }

    /// Does one step of every stage.
    pub fn step(&mut self, mut tap: Option<Tap>) {
        let step = self.step;
        let period_s = 1.0 / self.rate_hz;
        let tick = Tick { step, time_s: step as f64 * period_s, period_s };
        let stamp_ns = self.nodes.first().map_or(0, |n| n.book.simulated_ns(step));
        for stage in &mut self.stages {
            while let Some(gains) = stage.wanted.due(step) {
                stage.core.set_gains(&gains);
            }
            for (input, port) in stage.inputs.iter_mut().zip(&mut stage.ports) {
                let sample = match input.source {
                    Source::Slot(slot) => Some(&self.samples[slot]),
                    Source::SlotBefore(slot) => (step > 0).then(|| &self.samples[slot]),
                    Source::Ring(ring, delay) => step.checked_sub(delay).map(|past| self.rings[ring].at(past)),
                };
                match &mut input.line {
                    None => hold(port, sample),
                    Some(line) => {
                        if let Some(sample) = sample {
                            line.insert(sample, step);
                        }
                        let held = line.take(step);
                        *port = Port { sample: held.copied(), age_steps: age(step, input.lag, held.map(|s| s.step)) };
                    }
                }
            }
            let outputs = &mut self.samples[stage.slots.clone()];
            outputs.copy_from_slice(&self.blank[stage.slots.clone()]);
            stage.core.step(&tick, &stage.ports, outputs, &mut self.noted);
            let node = &mut self.nodes[stage.node];
            for sample in outputs.iter_mut() {
                // A core may have put a whole sample there.
                (sample.layout, sample.source) = (LAYOUT, node.book.source);
                // Every output speaks once per step, so its count is the step.
                (sample.step, sample.sequence, sample.stamp_ns) = (step, step, stamp_ns);
            }
            for ring in &mut self.rings[stage.rings.clone()] {
                ring.put(step, &self.samples[ring.slot]);
            }
            match &mut tap {
                None => drop(self.noted.drain()),
                Some(tap) => {
                    node.tell(stage, step, stamp_ns, &mut self.noted, *tap);
                    for slot in stage.slots.clone() {
                        tap(slot, &Message::Sample(self.samples[slot]));
                    }
                }
            }
        }
        self.step += 1;
    }
}

impl Node {
    /// What it reports beside its samples, in the order in which a process sends it.
    fn tell(&mut self, stage: &Stage, step: u64, stamp_ns: i64, noted: &mut Events, tap: Tap) {
        let events = self.events;
        self.book.drain(step, stamp_ns, noted, |_, event| tap(events, &Message::Event(event)));
        if stage.is_first
            && let Some(status) = self.book.status(step, stamp_ns, Health::default)
        {
            tap(self.status, &Message::Status(status));
        }
        if let (Some(topic), Some(now)) = (self.gains, stage.core.gains())
            && let Some(gains) = self.book.gains(step, stamp_ns, now)
        {
            tap(topic, &Message::Gains(gains));
        }
        if let Some(topic) = self.margin
            && let Some(margin) = self.book.margin(step, stamp_ns, || stage.core.margin())
        {
            tap(topic, &Message::Margin(margin));
        }
    }
}

impl Ring {
    fn at(&self, step: u64) -> &Sample {
        &self.samples[step as usize & (self.samples.len() - 1)]
    }

    fn put(&mut self, step: u64, sample: &Sample) {
        let mask = self.samples.len() - 1;
        self.samples[step as usize & mask] = *sample;
    }
}

/// Copies a sample straight into its port; building the port beside it first would copy it twice.
#[inline]
fn hold(port: &mut Port, sample: Option<&Sample>) {
    match (&mut port.sample, sample) {
        (Some(held), Some(sample)) => *held = *sample,
        (held, sample) => *held = sample.copied(),
    }
}

/// The inputs that a core sees. Nothing needs to be held back where everything is stepped in turn.
fn seen(inputs: &[InputPort]) -> impl Iterator<Item = &InputPort> {
    inputs.iter().filter(|p| p.name != PACE_PORT)
}

/// (plan, stage) of all stages, each after those of the same plans that it waits for in the same step.
pub(crate) fn stage_order(plans: &[NodePlan]) -> Result<Vec<(usize, usize)>, SequenceError> {
    Ok(order(plans)?.into_iter().map(|place| (place.node, place.stage)).collect())
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    node: usize,
    stage: usize,
}

/// Stages so that each comes after those it waits for in the same step; otherwise as the plans have them.
fn order(plans: &[NodePlan]) -> Result<Vec<Place>, SequenceError> {
    let stage_at = |p: &Place| &plans[p.node].stages[p.stage];
    let mut waiting: Vec<Place> =
        (0..plans.len()).flat_map(|node| (0..plans[node].stages.len()).map(move |stage| Place { node, stage })).collect();
    let outputs: Vec<&str> = waiting.iter().flat_map(|p| &stage_at(p).outputs).map(|o| o.topic.name.as_str()).collect();
    if let Some(twice) = outputs.iter().enumerate().find_map(|(i, name)| outputs[..i].contains(name).then_some(*name)) {
        return Err(SequenceError::TwoPublishers(twice.to_string()));
    }
    let mut order: Vec<Place> = Vec::new();
    while !waiting.is_empty() {
        let is_to_come = |topic: &Topic| waiting.iter().any(|p| stage_at(p).outputs.iter().any(|o| o.topic.name == topic.name));
        let next = waiting.iter().position(|p| !seen(&stage_at(p).inputs).any(|i| i.delay == 0 && is_to_come(&i.topic)));
        match next {
            Some(next) => order.push(waiting.remove(next)),
            None => {
                let names = waiting.iter().map(|p| format!("{}/{}", plans[p.node].name, stage_at(p).name));
                return Err(SequenceError::Loop(names.collect()));
            }
        }
    }
    Ok(order)
}
