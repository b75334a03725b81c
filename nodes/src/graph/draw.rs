//! Draws a graph as text: every node with its ports, every connection as a line beside them.

use super::{Connection, Direction, Graph, Node, NodeKind, ObserverFiles, Settings, check::order};
use backdrive_devices::file::Takes;
use std::fmt::Write;
use std::path::Path;

struct Row {
    text: String,
    /// The port of this row: (node, name, direction).
    port: Option<(usize, &'static str, Direction)>,
}

/// The graph as lines of text, nodes in the order in which they step.
pub fn draw(graph: &Graph) -> String {
    let rows = rows(graph);
    let width = rows.iter().map(|r| r.text.chars().count()).max().unwrap_or(0) + 1;
    let row_of = |end: &(usize, String), direction: Direction| {
        rows.iter().position(|r| r.port.is_some_and(|(n, p, d)| n == end.0 && p == end.1 && d == direction))
    };
    let mut wires: Vec<(usize, usize, &Connection)> = Vec::new();
    for connection in &graph.connections {
        if let (Some(from), Some(to)) = (row_of(&connection.from, Direction::Output), row_of(&connection.to, Direction::Input)) {
            wires.push((from, to, connection));
        }
    }
    let lanes = lanes(&wires);
    let columns = lanes.iter().max().map_or(0, |m| 3 * (m + 1) + 1);
    let mut text = format!("{}  ({} Hz, {})\n\n", graph.title, graph.timing.rate_hz, clock(graph));
    for (index, row) in rows.iter().enumerate() {
        let mut cells = vec![' '; columns];
        for ((from, to, _), lane) in wires.iter().zip(&lanes) {
            wire(&mut cells, index, *from, *to, 3 * lane + 2);
        }
        let notes: Vec<String> = wires.iter().filter(|(_, to, _)| *to == index).filter_map(|(.., c)| note(c)).collect();
        let line = format!("{:width$}{}  {}", row.text, cells.into_iter().collect::<String>(), notes.join(" "));
        let _ = writeln!(text, "{}", line.trim_end());
    }
    for group in &graph.together {
        let names: Vec<&str> = group.iter().map(|i| graph.nodes[*i].name.as_str()).collect();
        let _ = writeln!(text, "in one process: {}", names.join(" + "));
    }
    text
}

fn clock(graph: &Graph) -> String {
    let clock = format!("{:?}", graph.timing.clock).to_lowercase();
    match graph.duration_s() {
        Some(duration) => format!("{clock}, {duration} s"),
        None => clock,
    }
}

fn rows(graph: &Graph) -> Vec<Row> {
    let stages = order(graph).unwrap_or_default();
    let mut rows = Vec::new();
    for (node_index, stage_index) in stages {
        let (node, stage) = (&graph.nodes[node_index], &graph.nodes[node_index].kind.stages()[stage_index]);
        let part = if node.kind.stages().len() > 1 { format!(".{}", stage.name) } else { String::new() };
        rows.push(Row { text: format!("[{}{part}]  {}", node.name, describe(node)), port: None });
        for port in stage.inputs {
            let connected = graph.connections.iter().any(|c| c.to.0 == node_index && c.to.1 == port.name);
            if connected {
                rows.push(Row { text: format!("  > {}", port.name), port: Some((node_index, port.name, Direction::Input)) });
            }
        }
        for port in stage.outputs {
            let topic = graph.topic_of(node_index, port.name).name;
            rows.push(Row { text: format!("  < {:<9} {topic}", port.name), port: Some((node_index, port.name, Direction::Output)) });
        }
    }
    for node in graph.nodes.iter().filter(|n| n.kind == NodeKind::Recorder) {
        let bag = graph.bag.as_ref().map_or(String::new(), |b| b.display().to_string());
        rows.push(Row { text: format!("[{}]  every topic -> {bag}", node.name), port: None });
    }
    rows
}

fn describe(node: &Node) -> String {
    let kind = node.kind;
    if let Some(program) = node.command.as_ref().and_then(|words| words.first()) {
        let name = Path::new(program).file_name().map_or(program.clone(), |n| n.to_string_lossy().to_string());
        return format!("{}: the program {name}", kind.name());
    }
    if let Some(device) = &node.device {
        let unilateral = kind == NodeKind::Master && device.file.takes() != Takes::Effort;
        return format!(
            "{}: device {} ({}, {} joints{}{})",
            kind.name(),
            device.file.name,
            device.file.protocol.name(),
            device.file.joints.len(),
            if device.emulator.is_some() { ", emulated" } else { "" },
            if unilateral { "; unilateral: gives no force" } else { "" }
        );
    }
    match &node.settings {
        Settings::Master(device)
        | Settings::Slave(device)
        | Settings::Canceller(device, ..)
        | Settings::Shaft(device)
        | Settings::Rig(device, ..)
        | Settings::Observer(ObserverFiles { device, .. }) => {
            let model = device.model.as_ref().map_or("subtracts nothing", |m| m.name.as_str());
            match &device.fragment {
                Some(fragment) => format!("{}: {model} + {}", kind.name(), fragment.network.name),
                None => format!("{}: {model}", kind.name()),
            }
        }
        Settings::Controller { law, .. } => format!("{}: {}", kind.name(), law.law.name()),
        Settings::Coupling { law, .. } => format!("{}: {}", kind.name(), law.name()),
        Settings::Operator(_)
        | Settings::Scaling { .. }
        | Settings::Exciter(_)
        | Settings::Cycle(_)
        | Settings::SpeedControl(_)
        | Settings::Dynamometer(..)
        | Settings::Engine(_)
        | Settings::Recorder => kind.name().to_string(),
    }
}

fn note(connection: &Connection) -> Option<String> {
    let mut parts = Vec::new();
    if connection.delay > 0 {
        parts.push(format!("{} step{} late", connection.delay, if connection.delay == 1 { "" } else { "s" }));
    }
    if let Some(i) = &connection.impairment {
        parts.push(format!("impaired: {} s + 0..{} s, {} % lost", i.delay_s, i.jitter_s, 100.0 * i.loss));
    }
    (!parts.is_empty()).then(|| format!("({})", parts.join(", ")))
}

/// A lane per wire, so that wires whose spans overlap run in different lanes; wires of one output share theirs.
fn lanes(wires: &[(usize, usize, &Connection)]) -> Vec<usize> {
    let mut by_length: Vec<usize> = (0..wires.len()).collect();
    by_length.sort_by_key(|i| wires[*i].0.abs_diff(wires[*i].1));
    let mut lanes = vec![0; wires.len()];
    let mut placed: Vec<usize> = Vec::new();
    for i in by_length {
        let span = |w: usize| (wires[w].0.min(wires[w].1), wires[w].0.max(wires[w].1));
        let overlaps = |a: usize, b: usize| span(a).0 <= span(b).1 && span(b).0 <= span(a).1;
        let free = |lane: usize| placed.iter().all(|p| lanes[*p] != lane || wires[*p].0 == wires[i].0 || !overlaps(*p, i));
        lanes[i] = (0..).find(|lane| free(*lane)).unwrap_or(0);
        placed.push(i);
    }
    lanes
}

fn wire(cells: &mut [char], row: usize, from: usize, to: usize, column: usize) {
    let (top, bottom) = (from.min(to), from.max(to));
    if row < top || row > bottom {
        return;
    }
    if row == from || row == to {
        for cell in cells.iter_mut().take(column) {
            *cell = match *cell {
                '│' | '┼' => '┼',
                ' ' => '─',
                other => other,
            };
        }
        if row == to {
            cells[0] = '◀';
        }
        let corner = if row == top { '┐' } else { '┘' };
        cells[column] = match cells[column] {
            ' ' | '─' => corner,
            '│' | '┐' | '┘' => '┤',
            other => other,
        };
    } else {
        cells[column] = match cells[column] {
            '─' | '┼' => '┼',
            '┐' | '┘' => '┤',
            _ => '│',
        };
    }
}
