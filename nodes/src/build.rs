//! From a graph to what each process does.

use crate::graph::coupling;
use crate::graph::{DeviceFiles, Direction, Graph, Node, NodeKind, ObserverFiles, Settings};
use crate::stage::{Clock, InputPort, NodePlan, OutputPort, PACE_PORT, Stage};
use backdrive_control::canceller::Canceller;
use backdrive_control::changing_grip::ChangingGrip;
use backdrive_control::controller::Controller;
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_control::coupling::node::{FarNode, NearNode};
use backdrive_control::cycle::CycleNode;
use backdrive_control::device::{Device, DeviceError, DeviceOptions, DeviceRole};
use backdrive_control::dynamometer::{Dynamometer, DynamometerNode};
use backdrive_control::engine::EngineNode;
use backdrive_control::exciter::Exciter;
use backdrive_control::guard::Guard;
use backdrive_control::hand::HandBank;
use backdrive_control::live_margin::MarginEstimate;
use backdrive_control::master::Master;
use backdrive_control::mechanism::Mechanism;
use backdrive_control::observer::{DesignError, ObserverNode, Quantity, System, UnknownInput, design};
use backdrive_control::operator::Operator;
use backdrive_control::rig::Rig;
use backdrive_control::scaling::{Backward, Forward};
use backdrive_control::shaft::ShaftNode;
use backdrive_control::slave::Slave;
use backdrive_control::speed_control::SpeedControlNode;
use backdrive_devices::core::{BUS_NUMBERS, DeviceCore};
use backdrive_devices::side::Side;
use backdrive_devices::start::Source;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Gains, MAX_AXES, Sample, source_id};
use backdrive_plant::linear::Operating;

/// Oscillation of the reflected force that the guard leaves alone, N or N m: about what a finger does not feel.
const GUARD_LEAST_FORCE: f64 = 0.02;

/// Steps by which a source may run ahead of the recorder in lockstep; well within the recorder's buffers.
const AHEAD_OF_RECORDER: u64 = 1024;

/// Steps by which a source may run ahead of its listeners in lockstep where nothing records.
const AHEAD_OF_LISTENERS: u64 = 256;

/// Topic on which a recorder reports its progress; each host's has its own.
pub fn credit_topic(host: Option<&str>) -> Topic {
    let name = host.map_or("/recorder/credit".to_string(), |host| format!("/recorder/credit_{host}"));
    Topic { name, kind: Kind::Sample }
}

/// Topic on which a host's supervisor reports on the other hosts: their clocks, and when they are gone.
pub fn host_topic(host: &str) -> Topic {
    Topic { name: format!("/host_{host}/events"), kind: Kind::Event }
}

/// Why a graph cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// There is no such node.
    #[error("the graph has no node \"{0}\"")]
    NoSuchNode(String),
    /// A node's device does not work.
    #[error("node \"{node}\": {error}")]
    Device {
        /// The node.
        node: String,
        /// What is wrong.
        error: DeviceError,
    },
    /// A real device stands in a recording.
    #[error(
        "node \"{node}\" is the real device \"{device}\", which cannot be run from a recording; give a model of it: --{kind} MODEL.toml"
    )]
    Recorded {
        /// The node.
        node: String,
        /// Its device.
        device: String,
        /// `master` or `slave`.
        kind: &'static str,
    },
    /// A program brings the wrong number of cores.
    #[error("node \"{node}\": kind {kind} has {expected} stages, the program brings {given} cores")]
    Cores {
        /// The node.
        node: String,
        /// Its kind.
        kind: &'static str,
        /// Stages of the kind.
        expected: usize,
        /// Cores given.
        given: usize,
    },
}

/// A topic of a graph and who is on it.
#[derive(Debug, Clone)]
pub struct GraphTopic {
    /// Name and kind.
    pub topic: Topic,
    /// Name of the node that speaks on it.
    pub publisher: String,
    /// Names of the axes, for samples.
    pub axes: Vec<String>,
    /// Number of stages that wait for it, and of all subscribers, the recorder included.
    pub woken: usize,
    /// See `woken`.
    pub listeners: usize,
}

/// Every topic of a graph, in the order in which a lockstep bag holds the messages of one step.
pub fn topics(graph: &Graph) -> Vec<GraphTopic> {
    let recorded = graph.recorders().len();
    let mut topics = Vec::new();
    for (index, node) in graph.nodes.iter().enumerate().filter(|(_, n)| n.kind != NodeKind::Recorder) {
        for port in node.kind.ports(Direction::Output) {
            let topic = graph.topic_of(index, port);
            let woken = graph.connections.iter().filter(|c| c.from.0 == index && c.from.1 == port).count() + pacing(graph, &topic);
            let (publisher, axes) = (node.name.clone(), node.axis_names.clone());
            topics.push(GraphTopic { topic, publisher, axes, woken, listeners: woken + recorded });
        }
    }
    for node in graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder) {
        let mut side = |part: &str, kind: Kind| {
            let topic = Topic { name: format!("/{}/{part}", node.name), kind };
            topics.push(GraphTopic { topic, publisher: node.name.clone(), axes: Vec::new(), woken: 0, listeners: recorded });
        };
        if node.kind.closes_loop() {
            side("gains", Kind::Gains);
        }
        if node.kind == NodeKind::Scaling {
            side("margin", Kind::Margin);
        }
        side("events", Kind::Event);
        side("status", Kind::Status);
        for (topic, axes) in lists(node) {
            topics.push(GraphTopic { topic, publisher: node.name.clone(), axes, woken: 0, listeners: recorded });
        }
    }
    // A lockstep bag holds nothing that the machines decide.
    for host in graph.hosts.iter().filter(|_| graph.timing.clock == Clock::Realtime) {
        let (topic, publisher) = (host_topic(&host.name), format!("host_{}", host.name));
        topics.push(GraphTopic { topic, publisher, axes: Vec::new(), woken: 0, listeners: recorded });
    }
    topics
}

/// Lists of named numbers that a node with a real device publishes beside its samples: topic, and the names.
fn lists(node: &Node) -> Vec<(Topic, Vec<String>)> {
    let Some(device) = &node.device else { return Vec::new() };
    let of = |part: &str| Topic { name: format!("/{}/{part}", node.name), kind: Kind::Sample };
    let joints = device.file.axis_names();
    let bus = BUS_NUMBERS.iter().map(|name| (*name).to_string()).collect();
    vec![(of("bus"), bus), (of("current"), joints.clone()), (of("temperature"), joints)]
}

/// Whether nothing that it hears holds a node back.
fn is_source(kind: NodeKind) -> bool {
    !kind.stages().is_empty() && kind.stages().iter().all(|stage| stage.inputs.is_empty())
}

/// What holds the graph's sources back in lockstep: (topic, steps they may be ahead).
fn pace(graph: &Graph) -> Vec<(Topic, u64)> {
    if graph.timing.clock == Clock::Realtime {
        return Vec::new();
    }
    let recorders = graph.recorders();
    if !recorders.is_empty() {
        return recorders.into_iter().map(|host| (credit_topic(host), AHEAD_OF_RECORDER)).collect();
    }
    let nodes = graph.nodes.iter().enumerate().filter(|(_, n)| !is_source(n.kind));
    nodes.filter_map(|(i, n)| n.kind.ports(Direction::Output).first().map(|port| (graph.topic_of(i, port), AHEAD_OF_LISTENERS))).collect()
}

fn pacing(graph: &Graph, topic: &Topic) -> usize {
    let sources = graph.nodes.iter().filter(|n| is_source(n.kind)).count();
    if pace(graph).iter().any(|(t, _)| t == topic) { sources } else { 0 }
}

/// How many of a topic's listeners run on this of the graph's hosts: nodes, sources that it paces, the recorder.
pub fn listeners_on(graph: &Graph, topic: &Topic, host: &str) -> usize {
    let here = |node: &Node| graph.runs_on(node, host);
    let woken = graph.connections.iter().filter(|c| here(&graph.nodes[c.to.0]) && graph.topic_of(c.from.0, &c.from.1) == *topic).count();
    let paced = pace(graph).iter().any(|(t, _)| t == topic);
    let sources = graph.nodes.iter().filter(|n| paced && is_source(n.kind) && here(n)).count();
    let credit = graph.recorders().iter().any(|recorder| credit_topic(*recorder) == *topic);
    let recorded = graph.recorders().contains(&Some(host)) && !credit;
    woken + sources + usize::from(recorded)
}

/// Sources that wait for the credit of each recorder.
pub fn credit_listeners(graph: &Graph) -> usize {
    graph.recorders().first().map_or(0, |host| pacing(graph, &credit_topic(*host)))
}

/// The plan of one of our own nodes (not of a recorder).
pub fn plan(graph: &Graph, name: &str) -> Result<NodePlan, BuildError> {
    plan_with(graph, name, cores_of(graph, name)?)
}

/// The cores of one of our own nodes, one per stage of its kind: for who puts something of his own around them.
///
/// # Errors
/// There is no such node, or its device does not work.
pub fn cores_of(graph: &Graph, name: &str) -> Result<Vec<Box<dyn Core>>, BuildError> {
    let node = graph.node(name).ok_or_else(|| BuildError::NoSuchNode(name.to_string()))?;
    if let Some(device) = &node.device {
        let side = if node.kind == NodeKind::Master { Side::Master } else { Side::Slave };
        if device.is_recorded {
            let (node, kind) = (node.name.clone(), node.kind.name());
            return Err(BuildError::Recorded { node, device: device.file.name.clone(), kind });
        }
        let source = device.emulator.clone().map_or(Source::Port, Source::Emulator);
        return Ok(vec![Box::new(DeviceCore::new(device.file.clone(), side, source, graph.stale_after_s, graph.period_s()))]);
    }
    cores(graph, node).map_err(|error| BuildError::Device { node: node.name.clone(), error })
}

/// The plan of a node whose cores the caller brings, one per stage of the node's kind: how a program of
/// the user's own takes the place of one of ours.
pub fn plan_with(graph: &Graph, name: &str, cores: Vec<Box<dyn Core>>) -> Result<NodePlan, BuildError> {
    let index = graph.nodes.iter().position(|n| n.name == name).ok_or_else(|| BuildError::NoSuchNode(name.to_string()))?;
    let node = &graph.nodes[index];
    let kinds = node.kind.stages();
    if kinds.len() != cores.len() {
        let (kind, expected, given) = (node.kind.name(), kinds.len(), cores.len());
        return Err(BuildError::Cores { node: name.to_string(), kind, expected, given });
    }
    let mut stages = Vec::new();
    for (kind, core) in kinds.iter().zip(cores) {
        let mut inputs = Vec::new();
        let mut wiring = Vec::new();
        for port in kind.inputs {
            let connection = graph.connections.iter().find(|c| c.to.0 == index && c.to.1 == port.name);
            wiring.push(connection.map(|_| inputs.len()));
            inputs.extend(connection.map(|c| InputPort {
                name: port.name.to_string(),
                topic: c.topic.clone(),
                delay: c.delay,
                impairment: c.impairment,
            }));
        }
        let core = if wiring.iter().all(Option::is_some) { core } else { Box::new(Wired::new(core, wiring)) };
        if kind.inputs.is_empty() {
            inputs.extend(pace(graph).into_iter().map(|(topic, delay)| InputPort {
                name: PACE_PORT.to_string(),
                topic,
                delay,
                impairment: None,
            }));
        }
        let output = |port: &str| OutputPort { name: port.to_string(), topic: graph.topic_of(index, port), axes: node.axes };
        let outputs = kind.outputs.iter().map(|port| output(port.name)).collect();
        stages.push(Stage { name: kind.name.to_string(), inputs, outputs, core });
    }
    let side = |part: &str, kind: Kind| Topic { name: format!("/{name}/{part}"), kind };
    Ok(NodePlan {
        name: name.to_string(),
        stages,
        events: side("events", Kind::Event),
        status: side("status", Kind::Status),
        gains_in: None,
        gains_out: node.kind.closes_loop().then(|| side("gains", Kind::Gains)),
        margin_out: (node.kind == NodeKind::Scaling).then(|| side("margin", Kind::Margin)),
        lists: lists(node).into_iter().map(|(topic, names)| (topic, names.len())).collect(),
    })
}

fn cores(graph: &Graph, node: &Node) -> Result<Vec<Box<dyn Core>>, DeviceError> {
    let period_s = graph.period_s();
    let stale = graph.stale_after_s;
    let seed = graph.seed.wrapping_mul(0x9e37_79b9).wrapping_add(source_id(&node.name) as u64);
    let simulated = |files: &DeviceFiles, role: DeviceRole| -> Result<Option<Device>, DeviceError> {
        let Some(model) = &files.model else { return Ok(None) };
        let options = options(files, seed);
        Device::new(model, files.fragment.as_ref(), role, period_s, &options).map(Some)
    };
    let needed = |device: Option<Device>| device.ok_or_else(|| DeviceError::NoAxes("none".to_string()));
    Ok(match &node.settings {
        Settings::Operator(intents) => vec![Box::new(Operator::new(intents.clone()))],
        Settings::Master(files) => {
            let device: Box<dyn Mechanism> = match &files.model {
                Some(model) if !files.grip_changes.is_empty() => {
                    let (grip, options) = (files.fragment.as_ref(), options(files, seed));
                    Box::new(ChangingGrip::new(model, grip, &files.grip_changes, period_s, &options)?)
                }
                _ => Box::new(needed(simulated(files, DeviceRole::Master)?)?),
            };
            vec![Box::new(Master::new(device, stale, period_s))]
        }
        Settings::Canceller(files, high_pass_hz, hand) => vec![Box::new(match (hand, &files.model) {
            (Some(hand), Some(model)) => {
                let bank = HandBank::new(model, files.fragment.as_ref(), hand, period_s, &options(files, seed))?;
                Canceller::scheduled(bank, hand.edge_without, graph.gains.clone(), *high_pass_hz, period_s)
            }
            _ => Canceller::new(simulated(files, DeviceRole::Master)?, *high_pass_hz, period_s),
        })],
        Settings::Scaling { dither, guard } => {
            // The effect of a dither is no oscillation of the loop's own.
            let peak = dither.iter().flatten().fold(0.0_f64, |peak, d| peak.max(d.abs()));
            let guard = guard.then(|| Guard::new(node.axes, GUARD_LEAST_FORCE.max(peak), period_s));
            vec![
                Box::new(Forward::new(graph.gains.clone(), period_s)),
                Box::new(Backward::new(graph.gains.clone(), dither.clone(), guard, period_s)),
            ]
        }
        Settings::Coupling { law, velocity_hz } => {
            let conditions = coupling::conditions(graph);
            vec![
                Box::new(NearNode::new(node.axes, law, graph.gains.clone(), &conditions, *velocity_hz, stale)),
                Box::new(FarNode::new(node.axes, law, &conditions, stale)),
            ]
        }
        Settings::Slave(files) => vec![Box::new(Slave::new(needed(simulated(files, DeviceRole::Slave)?)?, stale, period_s))],
        Settings::Controller { law, model } => vec![Box::new(Controller::new(node.axes, law, model.as_ref(), stale, period_s)?)],
        Settings::Exciter(forces) => vec![Box::new(Exciter::new(forces.clone()))],
        Settings::Observer(files) => vec![Box::new(observer(graph, node, files)?)],
        Settings::Cycle(cycle) => vec![Box::new(CycleNode::new(cycle.clone()))],
        Settings::SpeedControl(control) => vec![Box::new(SpeedControlNode::new(*control))],
        Settings::Dynamometer(model, noise) => {
            vec![Box::new(DynamometerNode::new(Dynamometer::new(model.clone(), period_s), *noise, seed))]
        }
        Settings::Engine(file) => vec![Box::new(EngineNode::new(file.engine.clone(), file.ripple))],
        Settings::Shaft(files) => {
            let model = files.model.as_ref().ok_or_else(|| DeviceError::NoAxes("none".to_string()))?;
            vec![Box::new(ShaftNode::new(model, period_s, &options(files, seed))?)]
        }
        Settings::Recorder => Vec::new(),
        Settings::Rig(files, settings, demand) => {
            let seed = files.real_sensors.then(|| graph.seed.wrapping_mul(0x9e37_79b9).wrapping_add(u64::from(source_id("load cell"))));
            let device = needed(simulated(files, DeviceRole::Slave)?)?;
            vec![Box::new(Rig::new(device, *settings, demand.clone(), seed, period_s))]
        }
    })
}

fn options(files: &DeviceFiles, seed: u64) -> DeviceOptions {
    DeviceOptions { substeps: files.substeps, noise_seed: files.real_sensors.then_some(seed), quantise: files.real_sensors }
}

/// An observer with the gains that its model and its connections ask for.
fn observer(graph: &Graph, node: &Node, files: &ObserverFiles) -> Result<ObserverNode, DeviceError> {
    let model = files.device.model.as_ref().ok_or_else(|| DeviceError::NoAxes("none".to_string()))?;
    let connected = |port: &str| graph.connections.iter().any(|c| graph.nodes[c.to.0].name == node.name && c.to.1 == port);
    let [measured, user] = files.quantities;
    let user = connected("user").then_some(user);
    let wrong = |e: DesignError| DeviceError::Observer(model.name.clone(), e);
    let at = Operating::amplitude(files.amplitude);
    let system = System::of_model(model, &at, measured, user, &files.noise).map_err(|e| wrong(e.into()))?;
    let gains = design(&system, &files.weights, files.back_off).map_err(wrong)?;
    let core = UnknownInput::new(&system, &gains.k, &gains.l, graph.period_s());
    let velocity = [Some(measured), user].map(|quantity| quantity.map(|q| q == Quantity::Velocity));
    Ok(ObserverNode::new(core, velocity, connected("force"), files.filter, graph.period_s()))
}

/// Gives a core the ports it expects where the graph leaves some unconnected.
struct Wired {
    core: Box<dyn Core>,
    wiring: Vec<Option<usize>>,
    ports: Vec<Port>,
}

impl Wired {
    fn new(core: Box<dyn Core>, wiring: Vec<Option<usize>>) -> Wired {
        let ports = vec![Port::EMPTY; wiring.len()];
        Wired { core, wiring, ports }
    }
}

impl Core for Wired {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        for (port, wire) in self.ports.iter_mut().zip(&self.wiring) {
            if let Some(wire) = wire {
                *port = inputs[*wire];
            }
        }
        self.core.step(tick, &self.ports, outputs, events);
    }

    fn begin(&mut self) -> Result<Vec<String>, String> {
        self.core.begin()
    }

    fn report(&self, list: usize) -> Option<[f64; MAX_AXES]> {
        self.core.report(list)
    }

    fn set_gains(&mut self, gains: &Gains) {
        self.core.set_gains(gains);
    }

    fn set_active(&mut self, active: bool, ramp_s: f64) {
        self.core.set_active(active, ramp_s);
    }

    fn gains(&self) -> Option<(f64, f64)> {
        self.core.gains()
    }

    fn margin(&self) -> Option<MarginEstimate> {
        self.core.margin()
    }
}
