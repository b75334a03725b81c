//! The contact graph run in one process, for tests and studies of its stability.

#![allow(dead_code)] // each test program uses its own part

use backdrive_msgs::{Message, Sample};
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, Limits, NodeKind, Overrides, Sensors, Settings};
use backdrive_nodes::sequence::Sequence;
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_stability::judgement::judge;
use backdrive_stability::outcome::{Outcome, Trace};
use std::path::PathBuf;

/// A file of the workspace.
pub fn file(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The contact graph with noise-free sensors and no limits, changed as given.
pub fn contact(changes: Overrides) -> Graph {
    let changes = Overrides { sensors: Some(Sensors::Ideal), limits: Some(Limits::Ignored), ..changes };
    Graph::load(&file("launch/contact.toml"), &changes).unwrap()
}

/// The linear loop: linear master with the normal grip, a wall that pushes and pulls, nothing cancelled, a small bump of the hand.
pub fn linear(lambda: f64) -> Graph {
    let mut graph = contact(Overrides {
        master: Some(file("plant/models/impulse-engine-linear.toml")),
        environment: Some(file("plant/environments/bilateral-wall.toml")),
        canceller: Some("none".into()),
        lambda: Some(lambda),
        duration_s: Some(2.0),
        ..Overrides::default()
    });
    for node in &mut graph.nodes {
        if let Settings::Operator(intents) = &mut node.settings {
            let bump = vec![[0.0, 0.0], [0.02, 1e-4], [0.04, 0.0]];
            *intents = vec![backdrive_control::operator::Intent::Waypoints(bump)];
        }
    }
    graph
}

/// Gives a graph another canceller, with its grip.
pub fn cancel_with(graph: &mut Graph, edit: impl Fn(&mut backdrive_plant::model::Model)) {
    let master = graph.node_of(NodeKind::Master).unwrap().settings.clone();
    let Settings::Master(mut files) = master else { unreachable!() };
    edit(files.model.as_mut().unwrap());
    files.real_sensors = false;
    let node = graph.nodes.iter_mut().find(|n| n.kind == NodeKind::Canceller).unwrap();
    node.settings = Settings::Canceller(files, 0.0, None);
}

/// One value per step of what matters.
#[derive(Default)]
pub struct Signals {
    pub intent: Vec<f64>,
    pub measured: Vec<f64>,
    pub force: Vec<f64>,
    pub induced: Vec<f64>,
    pub command: Vec<f64>,
    pub contact: Vec<f64>,
    pub clamped: Vec<bool>,
}

/// Runs a graph in this process to its end, or until it leaves all bounds.
pub fn run(graph: &Graph) -> Signals {
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(graph, &n.name).unwrap()).collect();
    let mut sequence = Sequence::new(plans, &graph.timing).unwrap();
    let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
    let mut signals = Signals::default();
    let mut take = |topic: usize, message: &Message| {
        let Message::Sample(sample) = message else { return };
        let Sample { position, effort, .. } = sample;
        match names[topic].as_str() {
            "/operator/setpoint_js" => signals.intent.push(position[0]),
            "/master/measured_js" => {
                signals.measured.push(position[0]);
                signals.force.push(effort[0]);
                signals.clamped.push(sample.flags & backdrive_msgs::flag::LIMITED != 0);
            }
            "/canceller/induced_js" => signals.induced.push(position[0]),
            "/slave/servo_jp" => signals.command.push(position[0]),
            "/slave/measured_js" => signals.contact.push(effort[0]),
            _ => {}
        }
    };
    sequence.run(graph.timing.steps.unwrap(), Some(&mut take));
    signals
}

impl Signals {
    /// The verdict of the product on this run.
    pub fn outcome(&self, period_s: f64) -> Outcome {
        judge(&Trace {
            period_s,
            intent: self.intent.clone(),
            position: self.measured.clone(),
            contact: self.contact.clone(),
            feedback: self.force.clone(),
            clamped: self.clamped.clone(),
            ..Trace::default()
        })
    }
}

/// Growth of the slowest-dying motion, 1/s: slope of the logarithm of the RMS in windows of 50 ms over the second half.
pub fn growth(signal: &[f64], period_s: f64) -> f64 {
    if signal.iter().any(|x| !x.is_finite() || x.abs() > 1e100) {
        return f64::INFINITY;
    }
    let start = signal.len() / 2;
    let window = ((0.05 / period_s) as usize).max(1);
    let points: Vec<(f64, f64)> = signal[start..]
        .chunks_exact(window)
        .enumerate()
        .map(|(i, c)| (i as f64 * window as f64 * period_s, c.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-300).ln()))
        .collect();
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let xy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let xx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    xy / xx
}

/// The gain at which a monotone function of it crosses zero, by bisection to `tolerance` of itself.
pub fn edge(mut low: f64, mut high: f64, tolerance: f64, mut grows: impl FnMut(f64) -> bool) -> f64 {
    assert!(!grows(low), "already beyond the edge at {low}");
    assert!(grows(high), "not yet beyond the edge at {high}");
    while high - low > tolerance * low {
        let middle = (low * high).sqrt();
        if grows(middle) { high = middle } else { low = middle }
    }
    (low * high).sqrt()
}

/// Response of a device of the graph, held or loaded as in the graph, from its feedback to `output` at one frequency.
pub fn response(graph: &Graph, kind: NodeKind, hz: f64) -> nalgebra::Complex<f64> {
    let node = graph.node_of(kind).unwrap();
    let (Settings::Master(files) | Settings::Slave(files)) = &node.settings else { unreachable!() };
    let mut model = files.model.clone().unwrap();
    let axis = model.axes[0].clone();
    let attached = files.fragment.as_ref().map(|f| model.attach(f, axis.user, "port"));
    let output = match kind {
        NodeKind::Slave => {
            let elements = attached.unwrap().elements;
            model.outputs.push(backdrive_plant::model::Output {
                name: "contact".into(),
                kind: backdrive_plant::model::OutputKind::Force(elements),
                gain: -1.0,
                delay: 0.0,
                offset: 0.0,
                resolution: 0.0,
                noise: 0.0,
            });
            model.outputs.len() - 1
        }
        _ => axis.measured,
    };
    let linear = LinearModel::new(&model, &Operating::small()).unwrap();
    linear.response(axis.feedback, output, &[hz]).unwrap()[0]
}
