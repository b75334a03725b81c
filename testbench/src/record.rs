//! What a bag of a bench holds, as columns.

use backdrive_bags::{BagError, Reader, Signal, signals};
use backdrive_control::speed_control::SpeedControl;
use backdrive_nodes::graph::{Files, Graph, NodeKind, Overrides, Settings};
use backdrive_plant::tomlfile::FileError;
use std::path::Path;

/// Why a bench cannot be identified.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// Its graph cannot be read.
    #[error(transparent)]
    Graph(#[from] FileError),
    /// A bag that is not of a bench.
    #[error("{path}: {what}")]
    NoBench {
        /// The bag.
        path: String,
        /// What is missing in it.
        what: String,
    },
    /// The recording does not show what is asked of it.
    #[error("{step}: {what}")]
    Poor {
        /// The step of the identification.
        step: &'static str,
        /// What is missing, and what to record.
        what: String,
    },
    /// The observer has no gains.
    #[error("the observer: {0}")]
    Observer(#[from] backdrive_control::observer::DesignError),
}

/// A recording of a bench, one value per step in every column.
///
/// A torque of step k acts until step k+1; speeds and the torque in the shaft are measured at step k.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Time of a step, s.
    pub period_s: f64,
    /// Pedal, 0 to 1.
    pub pedal: Vec<f64>,
    /// Wanted speed, rad/s.
    pub setpoint: Vec<f64>,
    /// Torque added to the control's, N m; 0 where nothing is.
    pub added: Vec<f64>,
    /// Torque that the dynamometer shall give, N m.
    pub command: Vec<f64>,
    /// The converter's estimate of the torque, N m.
    pub torque: Vec<f64>,
    /// Measured speed of the engine, rad/s.
    pub engine_speed: Vec<f64>,
    /// Measured speed of the dynamometer, rad/s.
    pub dyno_speed: Vec<f64>,
    /// Measured torque in the shaft, N m.
    pub shaft_torque: Vec<f64>,
    /// What the simulated engine gave, ripple included, N m: the truth, which no identification uses.
    pub true_engine_torque: Vec<f64>,
    /// The observer's estimate of it that was recorded, N m; empty without an observer.
    pub observed: Vec<f64>,
    /// The speed control that was at work, at rest.
    pub control: SpeedControl,
}

impl Record {
    /// Reads a bag of a graph with a cycle, a speed control, a dynamometer, an engine and a shaft, whatever the nodes' names.
    ///
    /// # Errors
    /// When the bag cannot be read, or is not of such a graph.
    pub fn of_bag(path: &Path) -> Result<Record, BenchError> {
        let reader = Reader::open(path)?;
        let wrong = |what: String| BenchError::NoBench { path: path.display().to_string(), what };
        let header = reader.header().ok_or_else(|| wrong("contains no graph".to_string()))?;
        let graph = Graph::from_text(&header.graph_toml, path, &Overrides::default(), &Files::Bag(&header.files))?;
        let node = |kind: NodeKind| graph.nodes.iter().position(|n| n.kind == kind);
        let need = |kind: NodeKind| node(kind).ok_or_else(|| wrong(format!("its graph has no {} node", kind.name())));
        let mut wanted = Vec::new();
        let sources = [
            (NodeKind::Cycle, "pedal", "position"),
            (NodeKind::Cycle, "speed", "velocity"),
            (NodeKind::SpeedControl, "command", "effort"),
            (NodeKind::Dynamometer, "measured", "effort"),
            (NodeKind::Shaft, "engine", "velocity"),
            (NodeKind::Shaft, "dynamometer", "velocity"),
            (NodeKind::Shaft, "coupling", "effort"),
            (NodeKind::Engine, "torque", "effort"),
        ];
        for (kind, port, field) in sources {
            wanted.push(Signal::new(port, &graph.topic_of(need(kind)?, port).name, &format!("{field}[0]")));
        }
        let optional = [(NodeKind::Exciter, "force"), (NodeKind::Observer, "estimate")];
        let there = optional.map(|(kind, port)| node(kind).map(|n| Signal::new(port, &graph.topic_of(n, port).name, "effort[0]")));
        wanted.extend(there.iter().flatten().cloned());
        let control = match &graph.nodes[need(NodeKind::SpeedControl)?].settings {
            Settings::SpeedControl(control) => *control,
            _ => return Err(wrong("its speed control has no settings".to_string())),
        };
        let found = signals(&reader, &wanted)?;
        let mut columns = found.columns.into_iter();
        let mut next = || columns.next().unwrap_or_default();
        let [pedal, setpoint, command, torque, engine_speed, dyno_speed, shaft_torque, true_engine_torque] =
            std::array::from_fn(|_| next());
        let steps = pedal.len();
        let added = if there[0].is_some() { next() } else { vec![0.0; steps] };
        let observed = if there[1].is_some() { next() } else { Vec::new() };
        let measured = [&pedal, &setpoint, &torque, &engine_speed, &dyno_speed, &shaft_torque];
        if let Some(row) = (0..steps).find(|k| measured.iter().any(|c| !c[*k].is_finite())) {
            return Err(wrong(format!("step {row} lacks a measurement; a bench is identified from whole recordings")));
        }
        Ok(Record {
            period_s: graph.period_s(),
            pedal,
            setpoint,
            added,
            command: command.into_iter().map(|c| if c.is_finite() { c } else { 0.0 }).collect(),
            torque,
            engine_speed,
            dyno_speed,
            shaft_torque,
            true_engine_torque,
            observed,
            control,
        })
    }

    /// Steps.
    pub fn len(&self) -> usize {
        self.pedal.len()
    }

    /// Whether it has no step.
    pub fn is_empty(&self) -> bool {
        self.pedal.is_empty()
    }

    /// Times of the steps, s.
    pub fn times(&self) -> Vec<f64> {
        (0..self.len()).map(|k| k as f64 * self.period_s).collect()
    }
}
