//! What a graph must be to run: every needed input fed once, one publisher per topic, no loop without delay, axes that agree.

use super::{Connection, Direction, Graph, Node, NodeKind, Settings};
use backdrive_devices::file::Takes;
use backdrive_plant::model::InputKind;
use backdrive_plant::tomlfile::{FileError, Table};

pub(super) fn check(graph: &Graph, top: &Table) -> Result<(), FileError> {
    if graph.nodes.is_empty() {
        return Err(top.error("has no [[nodes]]"));
    }
    let at = |line: usize, key: String, message: String| FileError::at(top.file_name(), line, key, message);
    let of_node = |node: &Node, message: String| at(node.line, format!("node \"{}\"", node.name), message);
    let of_connection = |c: &Connection, message: String| {
        let (from, to) = (&graph.nodes[c.from.0].name, &graph.nodes[c.to.0].name);
        at(c.line, format!("connection {from}.{} -> {to}.{}", c.from.1, c.to.1), message)
    };

    if graph.nodes.iter().filter(|n| n.kind == NodeKind::Recorder).count() > 1 {
        return Err(top.error("has two recorders; one records every topic"));
    }
    inputs_are_fed(graph, &of_node, &of_connection)?;
    slaves_are_driven(graph, &of_node, &of_connection)?;
    one_publisher(graph, &of_node)?;
    axes_agree(graph, &of_node, &of_connection)?;
    no_loop_without_delay(graph, &of_connection)?;
    excitations_within_limits(graph, top)?;
    devices_can_run(graph, &of_node)?;
    for node in &graph.nodes {
        if node.restart && graph.timing.clock == crate::stage::Clock::Lockstep {
            return Err(of_node(node, "restart needs clock = \"realtime\": in lockstep the others cannot go on without it".into()));
        }
        if let Settings::Coupling { law, .. } = &node.settings
            && law.needs_hand()
            && !graph.connections.iter().any(|c| graph.nodes[c.to.0].name == node.name && c.to.1 == "hand")
        {
            let message = format!(
                "the law {} needs the force of the hand: connect the user of the master (in simulation) or the estimate of an \
                 observer to its input \"hand\"",
                law.name()
            );
            return Err(of_node(node, message));
        }
        if let Settings::Scaling { guard: true, .. } = node.settings
            && !graph.connections.iter().any(|c| graph.nodes[c.to.0].name == node.name && c.to.1 == "measured")
        {
            let message = "the guard needs the master: connect master.measured to its input \"measured\" with delay = 1";
            return Err(of_node(node, message.into()));
        }
    }
    Ok(())
}

type OfNode<'a> = dyn Fn(&Node, String) -> FileError + 'a;
type OfConnection<'a> = dyn Fn(&Connection, String) -> FileError + 'a;

fn inputs_are_fed(graph: &Graph, of_node: &OfNode, of_connection: &OfConnection) -> Result<(), FileError> {
    for (index, node) in graph.nodes.iter().enumerate() {
        for port in node.kind.ports(Direction::Input) {
            let mut feeding = graph.connections.iter().filter(|c| c.to.0 == index && c.to.1 == port);
            let required = node.kind.port(port, Direction::Input).is_some_and(|(_, p)| p.required);
            if feeding.next().is_none() && required {
                return Err(of_node(node, format!("nothing is connected to its input \"{port}\"")));
            }
            if let Some(second) = feeding.next() {
                return Err(of_connection(second, format!("the input \"{port}\" has another connection already: one publisher per input")));
            }
        }
    }
    Ok(())
}

/// A slave hears a command or a force, as its model's feedback is a motion or a force.
fn slaves_are_driven(graph: &Graph, of_node: &OfNode, of_connection: &OfConnection) -> Result<(), FileError> {
    for (index, node) in graph.nodes.iter().enumerate().filter(|(_, n)| n.kind == NodeKind::Slave) {
        let feeding = |port: &str| graph.connections.iter().find(|c| c.to.0 == index && c.to.1 == port);
        if let Some(device) = &node.device {
            let wanted = match device.file.takes() {
                Takes::Position => "command",
                Takes::Effort => "force",
                Takes::Nothing => {
                    let message = "its device takes nothing (takes = \"nothing\"), so it cannot follow; a slave needs position or effort";
                    return Err(of_node(node, message.into()));
                }
            };
            if feeding(wanted).is_none() {
                return Err(of_node(
                    node,
                    format!("its device takes {}, and nothing is connected to its input \"{wanted}\"", device.file.takes().name()),
                ));
            }
            continue;
        }
        let model = match &node.settings {
            Settings::Slave(files) => files.model.as_ref(),
            _ => None,
        };
        let by_force = model.and_then(|m| Some(m.inputs.get(m.axes.first()?.feedback)?.kind == InputKind::Force));
        let name = model.map_or("", |m| m.name.as_str());
        match (by_force, feeding("command"), feeding("force")) {
            (Some(true), _, None) => {
                return Err(of_node(
                    node,
                    format!(
                        "its model \"{name}\" is driven by a force: as a slave its feedback must be a motion input, or a node of kind \
                         \"controller\" must drive its input \"force\""
                    ),
                ));
            }
            (Some(true), Some(command), _) => {
                let message = format!(
                    "the model \"{name}\" is driven by a force and takes no command; connect the command to the input \"command\" of its \
                        controller"
                );
                return Err(of_connection(command, message));
            }
            (Some(false), _, Some(force)) => {
                let message = format!(
                    "the model \"{name}\" follows commands and takes no force; use a model whose feedback is a force, or connect only its \
                        command"
                );
                return Err(of_connection(force, message));
            }
            (Some(false), None, None) => return Err(of_node(node, "nothing is connected to its input \"command\"".into())),
            (None, None, None) => {
                return Err(of_node(node, "nothing is connected to its inputs \"command\" and \"force\"; it needs one of them".into()));
            }
            _ => {}
        }
    }
    Ok(())
}

/// A device has its own time, and one process owns its port.
fn devices_can_run(graph: &Graph, of_node: &OfNode) -> Result<(), FileError> {
    for node in &graph.nodes {
        let Some(device) = node.device.as_ref().filter(|device| !device.is_recorded) else { continue };
        if graph.timing.clock == crate::stage::Clock::Lockstep {
            let message = "a device runs in real time only: write clock = \"realtime\"; or simulate it (--master MODEL, --slave MODEL)";
            return Err(of_node(node, message.into()));
        }
        let same = |other: &&Node| {
            let theirs = other.device.as_ref().filter(|other| other.emulator.is_none() && device.emulator.is_none());
            other.name != node.name && theirs.is_some_and(|other| other.file.port == device.file.port)
        };
        if let Some(other) = graph.nodes.iter().find(same) {
            let port = device.file.port.display();
            return Err(of_node(node, format!("\"{}\" has the port {port} too: one process owns a port", other.name)));
        }
    }
    Ok(())
}

/// (topic, node index, port) of every output.
fn outputs(graph: &Graph) -> Vec<(String, usize, &'static str)> {
    let ports =
        |(index, node): (usize, &Node)| node.kind.ports(Direction::Output).into_iter().map(move |port| (index, port)).collect::<Vec<_>>();
    graph.nodes.iter().enumerate().flat_map(ports).map(|(index, port)| (graph.topic_of(index, port).name, index, port)).collect()
}

fn one_publisher(graph: &Graph, of_node: &OfNode) -> Result<(), FileError> {
    let outputs = outputs(graph);
    for (i, (topic, node, port)) in outputs.iter().enumerate() {
        if let Some((_, other, other_port)) = outputs[..i].iter().find(|(earlier, ..)| earlier == topic) {
            let (this, other) = (&graph.nodes[*node], &graph.nodes[*other]);
            return Err(of_node(
                this,
                format!("\"{port}\" publishes {topic}, and so does {}.{other_port}; give one of them another topic", other.name),
            ));
        }
    }
    Ok(())
}

fn axes_agree(graph: &Graph, of_node: &OfNode, of_connection: &OfConnection) -> Result<(), FileError> {
    for node in &graph.nodes {
        if let Settings::Operator(intents) = &node.settings
            && intents.len() > node.axes
        {
            return Err(of_node(node, format!("moves {} axes, but the device has {}", intents.len(), node.axes)));
        }
    }
    for connection in &graph.connections {
        let (from, to) = (&graph.nodes[connection.from.0], &graph.nodes[connection.to.0]);
        if from.axes != to.axes && to.kind != NodeKind::Recorder {
            return Err(of_connection(connection, format!("{} has {} axes and {} has {}", from.name, from.axes, to.name, to.axes)));
        }
    }
    Ok(())
}

/// A device would cut an excitation off at its limit of force, and a recording would show the cut one.
fn excitations_within_limits(graph: &Graph, top: &Table) -> Result<(), FileError> {
    for connection in graph.connections.iter().filter(|c| c.to.1 == "force") {
        let (exciter, master) = (&graph.nodes[connection.from.0], &graph.nodes[connection.to.0]);
        let (Settings::Exciter(forces), Settings::Master(files)) = (&exciter.settings, &master.settings) else { continue };
        for (samples, axis) in forces.iter().zip(files.model.iter().flat_map(|m| &m.axes)) {
            let peak = samples.iter().fold(0.0_f64, |peak, f| peak.max(f.abs()));
            // A little more passes: a peak at the limit may be rounded up.
            if let Some(limit) = axis.force.filter(|limit| peak > limit * (1.0 + 1e-9)) {
                let message = format!(
                    "reaches {peak:.3} on axis \"{}\", but \"{}\" is limited to a force of {limit}; lower its amplitude, or cut it off with limit={limit}",
                    axis.name, master.name
                );
                return Err(FileError::at(
                    top.file_name(),
                    line_in(top, &exciter.name, "force"),
                    format!("node \"{}\" force", exciter.name),
                    message,
                ));
            }
        }
    }
    Ok(())
}

/// Line of a key of a node.
fn line_in(top: &Table, node: &str, key: &str) -> usize {
    let tables = Table::parse(top.text(), top.file_name()).and_then(|mut top| top.tables("nodes")).unwrap_or_default();
    let is_it = |table: &mut Table| table.string("name").ok().flatten().as_deref() == Some(node);
    tables.into_iter().find_map(|mut table| is_it(&mut table).then(|| table.line_of(key))).unwrap_or(1)
}

fn no_loop_without_delay(graph: &Graph, of_connection: &OfConnection) -> Result<(), FileError> {
    match order(graph) {
        Ok(_) => Ok(()),
        Err(stuck) => {
            let loop_names: Vec<String> = stuck
                .iter()
                .map(|(node, stage)| format!("{}.{}", graph.nodes[*node].name, graph.nodes[*node].kind.stages()[*stage].name))
                .collect();
            let inside = |c: &&Connection| c.delay == 0 && stuck.contains(&stage_of(graph, &c.to, Direction::Input));
            let message = format!("a loop without delay runs through {}; give one of its connections delay = 1", loop_names.join(", "));
            let line = graph.connections.iter().rev().find(inside);
            Err(line
                .map_or_else(|| FileError::whole(graph.path.display().to_string(), message.clone()), |c| of_connection(c, message.clone())))
        }
    }
}

fn stage_of(graph: &Graph, end: &(usize, String), direction: Direction) -> (usize, usize) {
    (end.0, graph.nodes[end.0].kind.port(&end.1, direction).map_or(0, |(stage, _)| stage))
}

/// Indices of a node and of one of its stages.
type StageOf = (usize, usize);

/// All stages, each after those whose outputs of the same step it needs; or those that wait for each other.
pub(crate) fn order(graph: &Graph) -> Result<Vec<StageOf>, Vec<StageOf>> {
    let mut waiting: Vec<(usize, usize)> =
        graph.nodes.iter().enumerate().flat_map(|(n, node)| (0..node.kind.stages().len()).map(move |s| (n, s))).collect();
    let mut done = Vec::with_capacity(waiting.len());
    while !waiting.is_empty() {
        let ready = |stage: &(usize, usize)| {
            graph.connections.iter().filter(|c| c.delay == 0 && stage_of(graph, &c.to, Direction::Input) == *stage).all(|c| {
                let before = stage_of(graph, &c.from, Direction::Output);
                !waiting.contains(&before)
            })
        };
        let Some(next) = waiting.iter().position(ready) else { break };
        done.push(waiting.remove(next));
    }
    if waiting.is_empty() { Ok(done) } else { Err(only_loops(graph, waiting)) }
}

/// Of stages that cannot be ordered, those that feed each other, without those that only wait behind them.
fn only_loops(graph: &Graph, mut stuck: Vec<(usize, usize)>) -> Vec<(usize, usize)> {
    loop {
        let feeds = |stage: &(usize, usize)| {
            graph.connections.iter().any(|c| {
                c.delay == 0
                    && stage_of(graph, &c.from, Direction::Output) == *stage
                    && stuck.contains(&stage_of(graph, &c.to, Direction::Input))
            })
        };
        let kept: Vec<(usize, usize)> = stuck.iter().copied().filter(feeds).collect();
        if kept.len() == stuck.len() {
            return kept;
        }
        stuck = kept;
    }
}

/// All stages as (node, stage) in the order in which they step; a checked graph has one.
pub fn step_order(graph: &Graph) -> Vec<(usize, usize)> {
    order(graph).unwrap_or_default()
}
