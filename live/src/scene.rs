//! What is drawn of a run: its devices axis by axis, their travel, and where their walls stand.

use backdrive_nodes::graph::{Direction, Graph, Node, NodeKind, Settings};
use backdrive_plant::elements::Law;
use backdrive_plant::model::{Fragment, Model, Motion};
use serde::Serialize;

/// A device, drawn to scale.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Drawn {
    /// `master` or `slave`.
    pub role: &'static str,
    /// The topic of its measured position and force.
    pub topic: String,
    /// Unit of its positions.
    pub unit: &'static str,
    /// Per axis its name, limits of travel and walls, all in the unit of the position.
    pub axes: Vec<DrawnAxis>,
}

/// An axis of a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct DrawnAxis {
    pub name: String,
    pub travel: Option<[f64; 2]>,
    /// Positions at which something one-sided is touched.
    pub walls: Vec<f64>,
}

/// What is drawn, and what may be changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Scene {
    pub devices: Vec<Drawn>,
    /// Whether the graph has a canceller, a guard, and gains at all.
    pub has_canceller: bool,
    pub has_guard: bool,
    pub has_gains: bool,
}

/// Whether the positions of a node are angles: of a device by its model, of what is between devices as its master's.
pub(crate) fn turns(graph: &Graph, node: &Node) -> bool {
    let of = |node: &Node| model(node).map(|m| m.motion == Motion::Rotation);
    of(node).or_else(|| graph.node_of(NodeKind::Master).and_then(of)).unwrap_or(false)
}

fn model(node: &Node) -> Option<&Model> {
    match &node.settings {
        Settings::Master(files) | Settings::Slave(files) | Settings::Canceller(files, ..) | Settings::Rig(files, ..) => {
            files.model.as_ref()
        }
        _ => None,
    }
}

/// Positions at which a one-sided contact of an environment is touched.
fn walls(touched: Option<&Fragment>, own: &Model, axis: usize) -> Vec<f64> {
    let gap = |law: &Law| match law {
        Law::Contact(contact) => Some(contact.gap),
        Law::HuntCrossley(contact) => Some(contact.gap),
        _ => None,
    };
    let of_model = own.axes.get(axis).into_iter().flat_map(|a| &a.touches).filter_map(|e| gap(&own.elements.get(*e)?.law));
    // On an arm the environment is attached to one body, which need not be this axis.
    let attached = touched.filter(|_| own.arm.is_none()).into_iter().flat_map(|f| &f.network.elements).filter_map(|e| gap(&e.law));
    of_model.chain(attached).collect()
}

impl Scene {
    /// Of a graph.
    pub fn of(graph: &Graph) -> Scene {
        let drawn = |(index, node): (usize, &Node)| {
            let (role, environment) = match &node.settings {
                Settings::Master(_) => ("master", None),
                Settings::Slave(files) => ("slave", files.fragment.as_ref()),
                _ => return None,
            };
            let port = node.kind.ports(Direction::Output).into_iter().find(|port| *port == "measured")?;
            let axis = |(axis, name): (usize, &String)| {
                let known = model(node);
                let travel = known.and_then(|m| m.axes.get(axis)?.travel);
                DrawnAxis { name: name.clone(), travel, walls: known.map_or(Vec::new(), |m| walls(environment, m, axis)) }
            };
            let unit = if turns(graph, node) { "rad" } else { "m" };
            Some(Drawn {
                role,
                topic: graph.topic_of(index, port).name,
                unit,
                axes: node.axis_names.iter().enumerate().map(axis).collect(),
            })
        };
        Scene {
            devices: graph.nodes.iter().enumerate().filter_map(drawn).collect(),
            has_canceller: graph.node_of(NodeKind::Canceller).is_some(),
            has_guard: graph.nodes.iter().any(|n| matches!(n.settings, Settings::Scaling { guard: true, .. })),
            has_gains: graph.loop_node().is_some(),
        }
    }
}
