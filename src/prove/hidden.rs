//! The hidden plant as a master of a graph: its process at the other end of two pipes.

use backdrive_control::core::Core;
use backdrive_control::master::Master;
use backdrive_control::mechanism::Mechanism;
use backdrive_nodes::graph::{Graph, Node, NodeKind, Settings};
use backdrive_plant::model::Axis;
use backdrive_sealed::master::Reading;
use backdrive_sealed::process::RemoteMaster;
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
    let axes = match (&node.kind, &node.settings) {
        (NodeKind::Master, Settings::Master(files)) => files.model.as_ref().map(|m| m.axes.clone()),
        _ => None,
    };
    let axes = axes.ok_or_else(|| format!("node \"{}\" is no master with a model: its axes and their limits are not known", node.name))?;
    let device = Remote::start(words, axes)?;
    Ok(vec![Box::new(Master::new(Box::new(device), graph.stale_after_s, graph.period_s()))])
}

/// A device that another process has.
struct Remote {
    axes: Vec<Axis>,
    process: RemoteMaster,
    readings: Vec<Reading>,
    answers: bool,
}

impl Remote {
    fn start(words: &[String], axes: Vec<Axis>) -> Result<Remote, String> {
        let (program, arguments) = words.split_first().ok_or("no program is named")?;
        let mut command = Command::new(program);
        command.args(arguments);
        let process = RemoteMaster::start_process(command).map_err(|e| e.to_string())?;
        if process.axes() != axes.len() {
            return Err(format!("{program} has {} axes and the model {}", process.axes(), axes.len()));
        }
        Ok(Remote { axes, process, readings: Vec::new(), answers: true })
    }

    fn ask(&mut self, force: &[f64], hand: &[f64]) {
        // What is no number ends the process, and so does a loop that ran away.
        self.answers &= force.iter().chain(hand).all(|x| x.is_finite());
        if !self.answers {
            return;
        }
        match self.process.step(force, hand) {
            Ok(readings) => self.readings = readings.to_vec(),
            Err(_) => self.answers = false,
        }
    }

    fn told(&self, axis: usize, what: impl Fn(&Reading) -> f64) -> f64 {
        self.readings.get(axis).filter(|_| self.answers).map_or(f64::NAN, what)
    }
}

impl Mechanism for Remote {
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
