//! Connections, and the axes that nodes have from them.

use crate::graph::{Connection, Direction, Graph, NodeKind};
use crate::stage::Impairment;
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table, unknown};

pub(super) fn read_connection(mut table: Table, graph: &Graph) -> Result<Connection, FileError> {
    let from = read_end(&mut table, "from", Direction::Output, graph)?;
    let to = read_end(&mut table, "to", Direction::Input, graph)?;
    let delay = table.integer("delay", 0, 100_000)?.unwrap_or(0) as u64;
    let impairment = match table.table("impair")? {
        None => None,
        Some(mut impair) => {
            let impairment = Impairment {
                delay_s: impair.number_or("delay_s", Range::Between(0.0, 10.0), 0.0)?,
                jitter_s: impair.number_or("jitter_s", Range::Between(0.0, 10.0), 0.0)?,
                loss: impair.number_or("loss", Range::Between(0.0, 1.0), 0.0)?,
                seed: impair.integer("seed", 0, i64::MAX)?.map_or(graph.seed, |s| s as u64),
            };
            impair.finish()?;
            Some(impairment)
        }
    };
    let line = table.line();
    table.finish()?;
    let topic = graph.topic_of(from.0, &from.1);
    Ok(Connection { from, to, topic, delay, impairment, line })
}

fn read_end(table: &mut Table, key: &str, direction: Direction, graph: &Graph) -> Result<(usize, String), FileError> {
    let text = table.need_string(key)?;
    let Some((node, port)) = text.split_once('.') else {
        return Err(table.error_at(key, format!("expected \"node.port\", found \"{text}\"")));
    };
    let Some(index) = graph.nodes.iter().position(|n| n.name == node) else {
        let message = unknown("node", node, graph.nodes.iter().map(|n| n.name.as_str()));
        return Err(table.error_at(key, message));
    };
    let kind = graph.nodes[index].kind;
    if kind.port(port, direction).is_none() {
        let what = if direction == Direction::Input { "input port" } else { "output port" };
        let message = unknown(what, port, kind.ports(direction).iter().copied());
        return Err(table.error_at(key, format!("node \"{node}\" ({}): {message}", kind.name())));
    }
    Ok((index, port.to_string()))
}

/// A node without axes of its own (scaling, a canceller without a model, a short script) has those of what it is connected to.
pub(super) fn settle_axes(graph: &mut Graph) {
    let master = graph.nodes.iter().find(|n| n.kind == NodeKind::Master).map(|n| n.axis_names.clone());
    let slave = graph.nodes.iter().find(|n| n.kind == NodeKind::Slave).map(|n| n.axis_names.clone());
    let Some(names) = master.or(slave) else { return };
    for node in &mut graph.nodes {
        let follows =
            matches!(node.kind, NodeKind::Scaling | NodeKind::Coupling | NodeKind::Operator | NodeKind::Exciter) || node.axes == 0;
        if follows && node.kind != NodeKind::Recorder && node.axes <= names.len() {
            node.axis_names.clone_from(&names);
            node.axes = names.len();
        }
    }
}
