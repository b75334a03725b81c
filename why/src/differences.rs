//! Where the loop of a bag is not the loop of its graph: every node by itself on what it was given.

use crate::as_recorded::{as_recorded, put};
use crate::device::{DeviceFound, diagnose};
use crate::difference::Difference;
use crate::trial::Trial;
use crate::tuned::{Beside, Explained, tuned};
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_stability::by_itself::alone::AloneError;
use backdrive_stability::by_itself::compared::{AsIf, Compared, Sensor, compare};
use backdrive_stability::by_itself::recorded::{Quantity, Recorded};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// All that was compared.
#[derive(Debug, Clone, Default)]
pub struct Differences {
    /// Where something differs.
    pub found: Vec<Difference>,
    /// What could not be examined, and why.
    pub notes: Vec<String>,
}

/// Outputs whose samples have information, by node kind: port, quantity, and the input whose way carries it.
const TOLD: &[(NodeKind, &str, Quantity, &str, bool)] = &[
    (NodeKind::Canceller, "motion", Quantity::Position, "measured", true),
    (NodeKind::Scaling, "command", Quantity::Position, "motion", true),
    (NodeKind::Scaling, "force", Quantity::Effort, "contact", true),
    (NodeKind::Coupling, "command", Quantity::Position, "from_near", false),
    (NodeKind::Coupling, "force", Quantity::Effort, "from_far", false),
    (NodeKind::Slave, "measured", Quantity::Effort, "command", false),
    (NodeKind::Slave, "measured", Quantity::Position, "command", false),
    (NodeKind::Master, "measured", Quantity::Effort, "force", true),
    // Whether its force is late shows in the force itself.
    (NodeKind::Master, "measured", Quantity::Position, "", false),
];

/// How closely it is looked.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// A difference below this share of a signal counts as none.
    pub small: f64,
    /// How long a search for effects in the master may take on the clock.
    pub patience: Duration,
}

/// Compares every node of a graph with its bag; `hear` receives its name.
///
/// # Errors
/// A node that cannot be built.
pub fn differences(
    graph: &Graph,
    recorded: &Recorded,
    look: &Look,
    hear: &dyn Fn(&str),
    stop: &AtomicBool,
) -> Result<Differences, AloneError> {
    let mut all = Differences::default();
    for (index, node) in graph.nodes.iter().enumerate() {
        let told: Vec<_> = TOLD.iter().filter(|t| t.0 == node.kind).collect();
        if told.is_empty() {
            continue;
        }
        if !is_known(&node.settings) {
            all.notes.push(format!("{}: is an external program, so its correct output is not known", node.name));
            continue;
        }
        hear(&format!("{} alone", node.name));
        of_node(graph, index, (recorded, look.small), &told, &mut all)?;
    }
    for (index, node) in graph.nodes.iter().enumerate().filter(|(_, node)| matches!(node.kind, NodeKind::Master | NodeKind::Slave)) {
        let here: Vec<Difference> = all.found.iter().filter(|d| d.node == node.name && d.way.is_none()).cloned().collect();
        let Some(first) = chief(&here) else { continue };
        // Ways that are late are part of what it was given.
        let ways: Vec<Difference> = all.found.iter().filter(|d| d.way.is_some()).cloned().collect();
        let Some(device) = of_device(&as_recorded(graph, &ways), index, &here, (recorded, look), hear, stop) else { continue };
        // What the device explains is one cause, in however many outputs it shows.
        let explains = device.files.is_some();
        let kept =
            |d: &Difference| d.node != node.name || d.way.is_some() || (d.quantity, d.axis) == (first.quantity, first.axis) || !explains;
        all.found.retain(kept);
        all.found.iter_mut().filter(|d| d.node == node.name && d.way.is_none()).for_each(|d| d.device = Some(device.clone()));
    }
    Ok(all)
}

/// The difference of a device that stands for all of them: of its motion, where that differs.
fn chief(here: &[Difference]) -> Option<Difference> {
    let may = |d: &&Difference| may_be_the_device(&d.compared);
    here.iter().filter(may).find(|d| d.quantity == Quantity::Position).or_else(|| here.iter().find(may)).cloned()
}

/// What a device does that its model does not: numbers of it, else an effect; `None` where what its sensors do explains it better.
fn of_device(
    as_it_is: &Trial,
    index: usize,
    here: &[Difference],
    (recorded, look): (&Recorded, &Look),
    hear: &dyn Fn(&str),
    stop: &AtomicBool,
) -> Option<DeviceFound> {
    let node = &as_it_is.graph.nodes[index];
    let quantities: &[Quantity] = match node.kind {
        NodeKind::Slave => &[Quantity::Position, Quantity::Effort],
        _ => &[Quantity::Position],
    };
    hear(&format!("the {}, number by number", node.name));
    let simple = here.iter().filter(|d| quantities.contains(&d.quantity)).all(|d| !needs_diagnosis(&d.compared));
    let short = recorded.clone().until(most_rows(recorded, as_it_is));
    let found = Beside::new(as_it_is, &node.name, quantities, &short).and_then(|beside| tuned(&beside));
    // A gain of a sensor and a firmer hand are alike where everything grows as one exponential: what leaves less of it is the one.
    let by_sensors = here.iter().map(|d| d.compared.left).fold(0.0, f64::max);
    let explains = |found: &Explained| found.is_enough() && (!simple || found.left < 0.5 * by_sensors);
    let numbers = |found: Explained| {
        let mut changed = match &node.settings {
            Settings::Master(files) | Settings::Slave(files) => files.clone(),
            _ => return None,
        };
        found.numbers.iter().for_each(|n| n.knob.put(&mut changed, n.value));
        Some(DeviceFound {
            word: "parameters".to_string(),
            sentence: format!("other numbers of its model leave {:.1} % of its outputs", 100.0 * found.left),
            physics: Vec::new(),
            numbers: Vec::new(),
            tuned: found.numbers,
            files: Some(Box::new(changed)),
        })
    };
    if let Some(found) = found.clone().filter(explains) {
        return numbers(found);
    }
    if simple || look.patience.is_zero() {
        return None;
    }
    hear(&format!("the {}, effect by effect", node.name));
    diagnose(&as_it_is.graph, index, recorded, look.patience, stop)
}

/// Steps after the first touch that are compared, s, and most of them in all: an oscillation is fully visible within it.
const AFTER_TOUCH_S: f64 = 1.0;
const MOST_ROWS: usize = 20_000;

fn most_rows(recorded: &Recorded, trial: &Trial) -> usize {
    let graph = &trial.graph;
    let slave = graph.nodes.iter().position(|n| n.kind == NodeKind::Slave);
    let track = slave.and_then(|slave| recorded.track(&graph.topic_of(slave, "measured").name));
    let touch = track.and_then(|t| t.effort.iter().filter_map(|c| c.iter().position(|f| f.is_finite() && *f != 0.0)).min());
    touch.map_or(MOST_ROWS, |row| row + (AFTER_TOUCH_S / graph.period_s()) as usize).min(MOST_ROWS)
}

fn needs_diagnosis(compared: &Compared) -> bool {
    matches!(compared.as_if, AsIf::Otherwise | AsIf::Noisy { .. })
}

/// Whether the device itself may be what differs, and not only its sensor.
fn may_be_the_device(compared: &Compared) -> bool {
    needs_diagnosis(compared) || matches!(compared.as_if, AsIf::Changed { .. } | AsIf::Filtered { .. })
}

/// Whether what explains it may lie on a way: a delay, samples that do not come, a rate of its own, a low-pass.
fn may_be_a_way(compared: &Compared) -> bool {
    matches!(compared.as_if, AsIf::Changed { late: 1.., .. } | AsIf::Unsteady { .. } | AsIf::Held { .. } | AsIf::Filtered { .. })
}

/// A port of [`TOLD`].
type Port = (NodeKind, &'static str, Quantity, &'static str, bool);

/// Compares the outputs of one node. Where a way to it turns out to be late the node is examined again with this delay, so that one delay is not
/// taken for several things.
fn of_node(
    graph: &Graph,
    index: usize,
    (recorded, small): (&Recorded, f64),
    told: &[&Port],
    all: &mut Differences,
) -> Result<(), AloneError> {
    let node = &graph.nodes[index];
    let mut as_it_is = Trial::of(graph.clone());
    let mut ways: Vec<Difference> = Vec::new();
    for _ in 0..=MOST_WAYS {
        let mut found = Vec::new();
        let outputs = as_it_is.alone(&node.name, recorded)?;
        for (_, port, quantity, input, exact) in told {
            let topic = graph.topic_of(index, port).name;
            let (Some(track), Some(predicted)) = (recorded.track(&topic), outputs.iter().find(|p| p.topic == topic)) else {
                let note = format!("{topic} was not recorded, so {} cannot be checked", node.name);
                if !all.notes.contains(&note) {
                    all.notes.push(note);
                }
                continue;
            };
            for axis in 0..node.axes {
                let sensor = Sensor { exact: *exact, small, ..sensor_of(&node.settings, *quantity, axis) };
                let predicted: Vec<f64> = predicted.samples.iter().map(|s| quantity.of(s, axis)).collect();
                let Some(compared) = compare(track.column(*quantity, axis), &predicted, &sensor, graph.period_s()) else { continue };
                if compared.as_if == AsIf::Same {
                    continue;
                }
                found.push(Difference {
                    node: node.name.clone(),
                    kind: node.kind,
                    port: (*port).to_string(),
                    quantity: *quantity,
                    axis,
                    compared,
                    way: (may_be_a_way(&compared) && !input.is_empty()).then(|| (*input).to_string()),
                    device: None,
                });
            }
        }
        // A slave whose motion is right and whose force is late has a force sensor that is late.
        let moves_right = !found.iter().any(|d| d.quantity == Quantity::Position);
        found.iter_mut().filter(|d| d.kind == NodeKind::Slave && d.quantity == Quantity::Effort && moves_right).for_each(|d| d.way = None);
        let way = found.iter().filter(|d| d.way.is_some()).min_by(|a, b| a.compared.left.total_cmp(&b.compared.left)).cloned();
        match way.filter(|_| ways.len() < MOST_WAYS) {
            Some(way) => {
                put(&mut as_it_is, &way);
                ways.push(way);
            }
            None => {
                all.found.extend(ways);
                all.found.extend(found);
                return Ok(());
            }
        }
    }
    Ok(())
}

/// Ways to one node that may be late at once.
const MOST_WAYS: usize = 2;

fn is_known(settings: &Settings) -> bool {
    match settings {
        Settings::Master(files) | Settings::Slave(files) => files.model.is_some(),
        _ => true,
    }
}

/// The model of the sensor of a master's position.
fn sensor_of(settings: &Settings, quantity: Quantity, axis: usize) -> Sensor {
    let (Settings::Master(DeviceFiles { model: Some(model), real_sensors: true, .. }), Quantity::Position) = (settings, quantity) else {
        return Sensor::default();
    };
    let Some(axis) = model.axes.get(axis) else { return Sensor::default() };
    let Some(output) = model.outputs.get(axis.measured) else { return Sensor::default() };
    Sensor { resolution: axis.scale.abs() * output.resolution, noise: axis.scale.abs() * output.noise, ..Sensor::default() }
}
