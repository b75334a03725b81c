//! The master of a graph, run once more over what a session recorded.

use crate::session::Session;
use backdrive_control::device::{Device, DeviceOptions, DeviceRole};
use backdrive_msgs::MAX_AXES;
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::elements::Role;

/// What the master did.
#[derive(Debug, Clone, Default)]
pub(crate) struct MasterRun {
    /// Its ideal measurement, per axis and row, m or rad.
    pub position: Vec<Vec<f64>>,
    /// Energy that each element has taken by each row, J; empty unless asked for.
    pub taken: Vec<ElementRun>,
}

/// An element that takes energy.
#[derive(Debug, Clone)]
pub(crate) struct ElementRun {
    pub name: String,
    pub kind: &'static str,
    /// Whether it does so by dry friction or along its path, not by a damper.
    pub friction: bool,
    /// By row, J.
    pub taken_j: Vec<f64>,
}

/// What of a run is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Wanted {
    /// Under the recorded F_f, or under none.
    pub force: bool,
    /// Whether energies are counted: it costs time.
    pub energy: bool,
}

/// Substeps for a linear model whose energy is counted: it would be stepped by one whole period otherwise.
const LINEAR_SUBSTEPS: usize = 8;

/// Runs the graph's master under the recorded intent, its sensors ideal; a force or intent that is not measured stays unchanged.
///
/// # Errors
/// One sentence: no model, no intent though the model has a hand, a model that cannot be compiled.
pub(crate) fn run_master(session: &Session, graph: &Graph, wanted: Wanted) -> Result<MasterRun, String> {
    let node = graph.node_of(NodeKind::Master).ok_or("the graph has no master node")?;
    let Settings::Master(files) = &node.settings else { return Err("the graph's master has no settings".to_owned()) };
    let model = files.model.as_ref().ok_or_else(|| format!("node \"{}\" has no model: it is an external program", node.name))?;
    let linear = |e: &backdrive_plant::model::Element| matches!(e.law.role(), Role::Linear(_));
    let fragment = files.fragment.as_ref();
    let all_linear = model.elements.iter().chain(fragment.iter().flat_map(|f| &f.network.elements)).all(linear);
    let substeps = files.substeps.or((wanted.energy && all_linear).then_some(LINEAR_SUBSTEPS));
    let options = DeviceOptions { substeps, noise_seed: None, quantise: false };
    let mut device = Device::new(model, fragment, DeviceRole::Master, session.period_s, &options).map_err(|e| e.to_string())?;
    let axes = device.axes();
    if session.axes.len() < axes {
        return Err(format!("the model has {axes} axes and the record {}", session.axes.len()));
    }
    for (axis, signals) in session.axes.iter().enumerate().take(axes) {
        if device.has_hand(axis) && signals.intent.is_none() {
            return Err(format!("axis {}: the operator's intent was not recorded", signals.name));
        }
    }
    if wanted.energy {
        device.track_energy();
    }
    let names: Vec<(String, &'static str, bool)> =
        device.model().elements.iter().map(|e| (e.name.clone(), e.law.kind().name, !matches!(e.law.role(), Role::Linear(_)))).collect();
    let rows = session.len();
    let mut run = MasterRun { position: vec![Vec::with_capacity(rows); axes], taken: Vec::new() };
    if wanted.energy {
        let blank = |(name, kind, friction)| ElementRun { name, kind, friction, taken_j: Vec::with_capacity(rows) };
        run.taken = names.into_iter().map(blank).collect();
    }
    let (mut force, mut hand) = ([0.0; MAX_AXES], [0.0; MAX_AXES]);
    for row in 0..rows {
        for (axis, signals) in session.axes.iter().enumerate().take(axes) {
            let intent = signals.intent.as_ref().and_then(|i| i.get(row)).copied();
            hand[axis] = intent.filter(|x| x.is_finite()).unwrap_or(hand[axis]);
        }
        if row == 0 {
            device.start(&force[..axes], &hand[..axes]);
        } else {
            device.step(&force[..axes], &hand[..axes]);
        }
        if !device.is_finite() {
            return Err(format!("the model diverges at {:.3} s", row as f64 * session.period_s));
        }
        for (axis, position) in run.position.iter_mut().enumerate() {
            position.push(device.measured(axis));
        }
        for (index, element) in run.taken.iter_mut().enumerate() {
            element.taken_j.push(device.plant().dissipated_by(index));
        }
        for (axis, signals) in session.axes.iter().enumerate().take(axes) {
            let now = signals.force.get(row).copied().filter(|f| f.is_finite() && wanted.force);
            force[axis] = now.unwrap_or(if wanted.force { force[axis] } else { 0.0 });
        }
    }
    Ok(run)
}
