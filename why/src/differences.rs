//! Where the loop of a bag is not the loop of its graph: every node by itself on what it was given.

use crate::as_recorded::as_recorded;
use crate::device::diagnose_master;
use crate::difference::{Difference, delay};
use crate::numbers::wrong_number;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_stability::by_itself::alone::{AloneError, alone};
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
    let is_master = |d: &Difference| d.kind == NodeKind::Master && d.quantity == Quantity::Position && may_be_the_device(&d.compared);
    if let Some(place) = all.found.iter().position(is_master) {
        hear("the master, parameter by parameter");
        let Difference { node, axis, compared, .. } = all.found[place].clone();
        // Ways that are late are part of what it was given.
        let ways: Vec<Difference> = all.found.iter().filter(|d| d.way.is_some()).cloned().collect();
        let as_it_is = as_recorded(graph, &ways).graph;
        // A gain of a sensor and a firmer hand are alike where everything grows as one exponential: what leaves less of it is the one.
        let simple = !needs_diagnosis(&compared);
        let number =
            wrong_number(&as_it_is, &node, axis, recorded, compared.share).filter(|(_, left)| !simple || *left < 0.5 * compared.left);
        let device = number.map(|(found, _)| found).or_else(|| {
            (!simple && !look.patience.is_zero()).then(|| hear("the master, effect by effect"))?;
            diagnose_master(&as_it_is, recorded, look.patience, stop)
        });
        for d in all.found.iter_mut().filter(|d| is_master(d)) {
            d.device.clone_from(&device);
        }
    }
    Ok(all)
}

fn needs_diagnosis(compared: &Compared) -> bool {
    matches!(compared.as_if, AsIf::Otherwise | AsIf::Noisy { .. })
}

/// Whether the device itself may be what differs, and not only its sensor.
fn may_be_the_device(compared: &Compared) -> bool {
    needs_diagnosis(compared) || matches!(compared.as_if, AsIf::Changed { .. })
}

/// Whether what explains it is a delay of a way.
fn late(compared: &Compared) -> bool {
    matches!(compared.as_if, AsIf::Changed { late: 1.., .. } | AsIf::Unsteady { .. })
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
    let mut as_it_is = graph.clone();
    let mut ways: Vec<Difference> = Vec::new();
    for _ in 0..=MOST_WAYS {
        let mut found = Vec::new();
        let put = alone(&as_it_is, &node.name, recorded)?;
        for (_, port, quantity, input, exact) in told {
            let topic = graph.topic_of(index, port).name;
            let (Some(track), Some(predicted)) = (recorded.track(&topic), put.iter().find(|p| p.topic == topic)) else {
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
                    way: (late(&compared) && !input.is_empty()).then(|| (*input).to_string()),
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
                delay(&mut as_it_is, index, &way);
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
