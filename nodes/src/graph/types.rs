//! A graph as data.

use super::kinds::NodeKind;
use crate::graph::bench;
use crate::stage::{Impairment, Timing};
use backdrive_control::changing_grip::GripChange;
use backdrive_control::coupling::Law;
use backdrive_control::cycle::Cycle;
use backdrive_control::dynamometer::DynamometerModel;
use backdrive_control::hand::HandSettings;
use backdrive_control::observer::{Quantity, Weights};
use backdrive_control::operator::Intent;
use backdrive_control::rig::RigSettings;
use backdrive_control::scaling::GainPlan;
use backdrive_control::speed_control::SpeedControl;
use backdrive_devices::file::DeviceFile;
use backdrive_msgs::topic::Topic;
use backdrive_plant::model::{Fragment, Model};
use std::net::Ipv4Addr;
use std::path::PathBuf;

/// A graph, read and checked. Paths in it are absolute, but for files that a bag holds.
#[derive(Debug, Clone)]
pub struct Graph {
    /// One line for a person.
    pub title: String,
    /// The file's text with the command line's changes and absolute paths written into it: what each
    /// process reads. What the bag holds is [`Graph::portable`].
    pub text: String,
    /// Where it was read.
    pub path: PathBuf,
    /// Rate, clock, number of steps.
    pub timing: Timing,
    /// Seed of everything random in it: noise, impairments, excitations.
    pub seed: u64,
    /// Gains at the start and later.
    pub gains: GainPlan,
    /// Time from the last sample of an input to the start of the decay, s. The force is zero within twice that time.
    pub stale_after_s: f64,
    /// The bag to record, if there is a recorder.
    pub bag: Option<PathBuf>,
    /// Whether a bag that exists may be replaced.
    pub overwrite: bool,
    /// Whether the bag records the machine and the folders that it was made from.
    pub record_origin: bool,
    /// Where nodes run, in the order of the file; empty for a graph that runs on one host.
    pub hosts: Vec<Host>,
    /// In the order of the file.
    pub nodes: Vec<Node>,
    /// In the order of the file.
    pub connections: Vec<Connection>,
    /// Whether nodes wait by looking all the time, which keeps a processor busy for each process.
    pub polls: bool,
    /// Nodes that share a process, as their indices; every other node is a process of its own.
    pub together: Vec<Vec<usize>>,
    /// Every file that was read for it but the graph itself: (path as in `text`, text).
    pub files: Vec<(String, String)>,
    /// Runs of their own that the file lists, each with changes to the nodes.
    pub experiments: Vec<Experiment>,
}

/// One run of a graph file that lists several.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Name of its recording.
    pub name: String,
    /// Whether its recording is kept from fits.
    pub held_out: bool,
    /// Which step of a protocol it belongs to: its recordings make a set of their own.
    pub step: Option<String>,
    /// Line of the file where it begins.
    pub line: usize,
}

/// A host of a graph that runs on several, `[hosts.NAME]`. The first decides when the run starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Host {
    /// What `--host` names.
    pub name: String,
    /// Where the others reach it by unicast, for networks without multicast.
    pub address: Option<Ipv4Addr>,
    /// Name or address of the interface that it uses; all without.
    pub interface: Option<String>,
    /// Line of the file where it begins.
    pub line: usize,
}

/// A node of a graph: a process, or with others a part of one ([`Graph::together`]).
#[derive(Debug, Clone)]
pub struct Node {
    /// Unique in the graph.
    pub name: String,
    /// What it is.
    pub kind: NodeKind,
    /// The user's own program in place of ours: program and arguments.
    pub command: Option<Vec<String>>,
    /// The host that it runs on, where the graph has hosts.
    pub host: Option<String>,
    /// Whether the supervisor starts it again when it dies (real time only).
    pub restart: bool,
    /// Axes of its samples.
    pub axes: usize,
    /// Names of its axes.
    pub axis_names: Vec<String>,
    /// Topics that the file names for its output ports, in place of the usual ones.
    pub topics: Vec<(String, String)>,
    /// The real device of a master or slave, in place of a simulated one.
    pub device: Option<RealDevice>,
    /// What its kind needs.
    pub settings: Settings,
    /// Line of the file where it begins.
    pub line: usize,
}

/// A real device of a master or slave.
#[derive(Debug, Clone, PartialEq)]
pub struct RealDevice {
    /// Its file, read.
    pub file: DeviceFile,
    /// The file of an emulator that takes its place. It is never a part of a recording.
    pub emulator: Option<PathBuf>,
    /// Whether the graph stands in a recording, so that the device is not opened: a recording may come from a stranger.
    pub is_recorded: bool,
}

/// A simulated device's files, read.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceFiles {
    /// The model; `None` for a canceller that subtracts nothing, and for a device that only the user's own program knows.
    pub model: Option<Model>,
    /// A grip or an environment.
    pub fragment: Option<Fragment>,
    /// Substeps per period; chosen from the model where `None`.
    pub substeps: Option<usize>,
    /// Whether sensors have the rounding and noise of the model file.
    pub real_sensors: bool,
    /// How a master's hand changes its grip, times ascending; empty where it does not.
    pub grip_changes: Vec<GripChange>,
}

/// What a node's kind needs beyond its ports.
#[derive(Debug, Clone)]
pub enum Settings {
    /// The hand's intent, per axis.
    Operator(Vec<Intent>),
    /// The master plant and its grip.
    Master(DeviceFiles),
    /// The model that predicts induced motion, the corner of its high-pass, Hz (0: none), and how the hand is estimated; `None` where the grip of the
    /// file is used.
    Canceller(DeviceFiles, f64, Option<HandSettings>),
    /// Dither per axis as samples, N or N m, and whether the guard watches.
    Scaling {
        /// One value per step; empty without a dither.
        dither: Vec<Vec<f64>>,
        /// Whether the guard watches.
        guard: bool,
    },
    /// The law between master and slave.
    Coupling {
        /// The law with its values.
        law: Law,
        /// Corner of the low-pass behind which velocities are computed from positions, Hz.
        velocity_hz: f64,
    },
    /// The slave and what it touches.
    Slave(DeviceFiles),
    /// Law and gains of a slave's controller, and the model that it knows of the slave.
    Controller {
        /// Law and gains.
        law: backdrive_control::controller::Settings,
        /// What it knows of the axes, if it knows anything.
        model: Option<Model>,
    },
    /// Forces per axis as samples, N or N m, one value per step.
    Exciter(Vec<Vec<f64>>),
    /// What is observed, and how.
    Observer(ObserverFiles),
    /// Pedal and speed over time.
    Cycle(Cycle),
    /// Gains and limit.
    SpeedControl(SpeedControl),
    /// The machine, and the deviation of its converter's estimate, N m.
    Dynamometer(DynamometerModel, f64),
    /// Map, lag and ripple.
    Engine(bench::EngineFile),
    /// The two machines' inertias and what is between them.
    Shaft(DeviceFiles),
    /// Records every topic.
    Recorder,
    /// The ram with its specimen, its controller, and the demanded displacement per axis as samples, m or rad, one value per step.
    Rig(DeviceFiles, RigSettings, Vec<Vec<f64>>),
}

/// The settings of an observer node.
#[derive(Debug, Clone)]
pub struct ObserverFiles {
    /// The model of the device, without what holds it.
    pub device: DeviceFiles,
    /// What is measured where the known force acts, and where the unknown one does.
    pub quantities: [Quantity; 2],
    /// Order of magnitude of the measurement noise, per measured quantity: all axes of `measured`, then all of `user`.
    pub noise: Vec<f64>,
    /// What errors and disturbances weigh.
    pub weights: Weights,
    /// How far m is kept above the least one, above 1.
    pub back_off: f64,
    /// Amplitude of displacement at which elements that are not linear are evaluated, m or rad.
    pub amplitude: f64,
    /// Order and corner (Hz, 0 for none) of the Butterworth filter.
    pub filter: (usize, f64),
}

/// A connection from an output port to an input port.
#[derive(Debug, Clone)]
pub struct Connection {
    /// Index of the sending node, and its port.
    pub from: (usize, String),
    /// Index of the receiving node, and its port.
    pub to: (usize, String),
    /// The topic that carries it.
    pub topic: Topic,
    /// Steps by which the receiver lags.
    pub delay: u64,
    /// What is done to it on purpose.
    pub impairment: Option<Impairment>,
    /// Line of the file where it begins.
    pub line: usize,
}

impl Graph {
    /// A node by its name.
    pub fn node(&self, name: &str) -> Option<&Node> {
        self.nodes.iter().find(|n| n.name == name)
    }

    /// The first node of a kind.
    pub fn node_of(&self, kind: NodeKind) -> Option<&Node> {
        self.nodes.iter().find(|n| n.kind == kind)
    }

    /// The node that closes the loop: scaling, or a coupling in its place.
    pub fn loop_node(&self) -> Option<&Node> {
        self.nodes.iter().find(|n| n.kind.closes_loop())
    }

    /// The topic that an output port of a node speaks on.
    pub fn topic_of(&self, node: usize, port: &str) -> Topic {
        let sender = &self.nodes[node];
        let named = sender.topics.iter().find(|(p, _)| p == port).map(|(_, name)| name.clone());
        let receiver = self.connections.iter().find(|c| c.from.0 == node && c.from.1 == port).map(|c| self.nodes[c.to.0].name.as_str());
        let name = named.unwrap_or_else(|| sender.kind.usual_topic(port, &sender.name, receiver));
        Topic { name, kind: backdrive_msgs::topic::Kind::Sample }
    }

    /// Time of one step, s.
    pub fn period_s(&self) -> f64 {
        1.0 / self.timing.rate_hz
    }

    /// Length of the run, s; `None` where it ends when it is stopped.
    pub fn duration_s(&self) -> Option<f64> {
        self.timing.steps.map(|steps| steps as f64 / self.timing.rate_hz)
    }
}
