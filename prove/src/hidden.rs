//! The hidden plant as a master of a graph: its process at the other end of two pipes, or, once the verdict is written, beside the loop.

use backdrive_control::core::Core;
use backdrive_control::master::Master;
use backdrive_control::mechanism::Mechanism;
use backdrive_nodes::graph::{Graph, Node, NodeKind, Settings};
use backdrive_plant::model::Axis;
use backdrive_sealed::master::{MasterOptions, Reading, Regrip, SealedMaster};
use backdrive_sealed::network::{Grip, Network};
use backdrive_sealed::process::RemoteMaster;
use backdrive_sealed::truth::Truth;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Name of the program that holds the hidden plant.
pub const PROGRAM: &str = "backdrive-sealed";

/// How the hidden plant is started. Only that process opens the truth.
#[derive(Debug, Clone)]
pub struct Hidden {
    /// The program.
    pub program: PathBuf,
    /// The nominal model that the truth is about.
    pub model: PathBuf,
    /// The nominal grip.
    pub grip: Option<PathBuf>,
    /// The sealed truth.
    pub truth: PathBuf,
    /// Samples per second.
    pub rate_hz: f64,
}

impl Hidden {
    /// The program's command line for a run; every number has sensor noise of its own, and the hand grips so firmly.
    pub fn words(&self, number: u32, firmness: f64) -> Vec<String> {
        let path = |p: &Path| p.display().to_string();
        let mut words = vec![path(&self.program), "run".into(), "--model".into(), path(&self.model), "--truth".into(), path(&self.truth)];
        if let Some(grip) = &self.grip {
            words.extend(["--grip".into(), path(grip)]);
        }
        words.extend(["--number".into(), number.to_string(), "--firmness".into(), firmness.to_string()]);
        words.extend(["--rate".into(), self.rate_hz.to_string()]);
        words
    }
}

/// Where the program is: beside this one, or where a shell would find it.
pub fn program() -> PathBuf {
    let beside = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.join(PROGRAM)));
    beside.filter(|p| p.is_file()).unwrap_or_else(|| PathBuf::from(PROGRAM))
}

/// The core of a master whose device is the process that `words` start.
pub fn core(graph: &Graph, node: &Node, words: &[String]) -> Result<Vec<Box<dyn Core>>, String> {
    let (program, arguments) = words.split_first().ok_or("no program is named")?;
    let mut command = Command::new(program);
    command.args(arguments);
    let mut process = RemoteMaster::start_process(command).map_err(|e| e.to_string())?;
    let axes = process.axes();
    let ask = move |force: &[f64], hand: &[f64], into: &mut Vec<Reading>| {
        // A loop that ran away gets no answer: what is no number ends the process.
        let said = force.iter().chain(hand).all(|x| x.is_finite()).then(|| process.step(force, hand).ok()).flatten();
        into.clear();
        into.extend_from_slice(said.unwrap_or(&[]));
    };
    master(graph, node, axes, Box::new(ask))
}

/// A truth that may be looked at, with the nominal device held as a session holds it: the scorer's hidden plant, without a process and its pipes.
pub struct Opened {
    held: Network,
    truth: Truth,
    period_s: f64,
}

impl Opened {
    /// The device that `truth` makes of the files that `hidden` names.
    pub fn new(hidden: &Hidden, truth: &Truth) -> Result<Opened, String> {
        let read =
            |path: &Path| backdrive_plant::input_file::read_to_string(path).map_err(|e| format!("{}: cannot be read: {e}", path.display()));
        let name = |path: &Path| path.display().to_string();
        let free = Network::from_toml(&read(&hidden.model)?, &name(&hidden.model)).map_err(|e| e.to_string())?;
        let held = match &hidden.grip {
            None => free,
            Some(path) => free.held(&Grip::from_toml(&read(path)?, &name(path)).map_err(|e| e.to_string())?),
        };
        Ok(Opened { held, truth: truth.clone(), period_s: 1.0 / hidden.rate_hz })
    }

    /// Puts what the sensors do to a position into the master's model: what is noise is no oscillation.
    pub fn tell_sensors(&self, graph: &mut Graph) {
        for node in graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Master) {
            let Settings::Master(files) = &mut node.settings else { continue };
            for output in files.model.iter_mut().flat_map(|m| m.outputs.iter_mut()) {
                if let Some(sensor) = self.truth.sensors.iter().find(|s| s.output == output.name) {
                    (output.resolution, output.noise) = (sensor.resolution, sensor.noise);
                }
            }
        }
    }

    /// The core of a master that is this device, in a run with sensor noise of its own.
    pub fn core(&self, graph: &Graph, node: &Node, run: u32, firmness: f64) -> Result<Vec<Box<dyn Core>>, String> {
        let changes = match &node.settings {
            Settings::Master(files) => &files.grip_changes[..],
            _ => &[],
        };
        let regrips = changes.iter().map(|change| Regrip { at_s: change.at_s, scale: change.scale }).collect();
        let options = MasterOptions { period_s: self.period_s, run, firmness, regrips, coarse: true };
        let mut plant = SealedMaster::new(&self.held, &self.truth, &options).map_err(|e| e.to_string())?;
        let axes = plant.axes();
        let mut started = false;
        let ask = move |force: &[f64], hand: &[f64], into: &mut Vec<Reading>| {
            let done = if started { plant.step(force, hand) } else { plant.start(hand) };
            started = true;
            into.clear();
            if done.is_ok() {
                into.extend((0..axes).filter_map(|axis| plant.reading(axis)));
            }
        };
        master(graph, node, axes, Box::new(ask))
    }
}

/// Asks a device for its next readings under forces and with hands; none where it does not answer any more.
type Ask = Box<dyn FnMut(&[f64], &[f64], &mut Vec<Reading>) + Send>;

fn master(graph: &Graph, node: &Node, has: usize, ask: Ask) -> Result<Vec<Box<dyn Core>>, String> {
    let axes = match (&node.kind, &node.settings) {
        (NodeKind::Master, Settings::Master(files)) => files.model.as_ref().map(|m| m.axes.clone()),
        _ => None,
    };
    let axes =
        axes.ok_or_else(|| format!("node \"{}\" is not a master with a model: its axes and their limits are not known", node.name))?;
    if has != axes.len() {
        return Err(format!("the hidden plant has {has} axes and the model of \"{}\" {}", node.name, axes.len()));
    }
    let device = Hiding { axes, ask, readings: Vec::new(), answers: true };
    Ok(vec![Box::new(Master::new(Box::new(device), graph.stale_after_s, graph.period_s()))])
}

/// A device of which only what a graph carries can be read.
struct Hiding {
    axes: Vec<Axis>,
    ask: Ask,
    readings: Vec<Reading>,
    answers: bool,
}

impl Hiding {
    fn ask(&mut self, force: &[f64], hand: &[f64]) {
        if self.answers {
            (self.ask)(force, hand, &mut self.readings);
            self.answers = self.readings.len() == self.axes.len();
        }
    }

    fn told(&self, axis: usize, what: impl Fn(&Reading) -> f64) -> f64 {
        self.readings.get(axis).filter(|_| self.answers).map_or(f64::NAN, what)
    }
}

impl Mechanism for Hiding {
    fn axes(&self) -> usize {
        self.axes.len()
    }

    fn axis(&self, axis: usize) -> &Axis {
        &self.axes[axis]
    }

    fn start(&mut self, _force: &[f64], hand: &[f64]) {
        self.ask(&[], hand);
    }

    fn step(&mut self, force: &[f64], hand: &[f64]) {
        self.ask(force, hand);
    }

    fn measured(&self, axis: usize) -> f64 {
        self.told(axis, |r| r.measured)
    }

    fn user_position(&self, axis: usize) -> f64 {
        self.told(axis, |r| r.position)
    }

    fn user_velocity(&self, axis: usize) -> f64 {
        self.told(axis, |r| r.velocity)
    }

    fn port_force(&self, axis: usize) -> f64 {
        self.told(axis, |r| r.force)
    }

    fn is_finite(&self) -> bool {
        self.answers && self.readings.iter().all(|r| r.measured.is_finite())
    }
}
