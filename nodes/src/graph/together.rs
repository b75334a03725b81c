//! Nodes that share a process: `together = ["scaling", "canceller"]`, or a list of such lists.

use super::{Graph, Node, NodeKind};
use backdrive_plant::tomlfile::{FileError, Table, unknown};

/// Reads `together`: per process the indices of its nodes, in the order of the file. Nodes and connections are read already.
pub(super) fn read_together(top: &mut Table, graph: &Graph) -> Result<Vec<Vec<usize>>, FileError> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for names in top.string_lists("together")?.unwrap_or_default() {
        let mut group: Vec<usize> = Vec::new();
        for name in &names {
            let Some(index) = graph.nodes.iter().position(|n| n.name == *name) else {
                let known: Vec<&str> = graph.nodes.iter().map(|n| n.name.as_str()).collect();
                return Err(top.error_at("together", unknown("node", name, known)));
            };
            if group.contains(&index) || groups.iter().any(|g| g.contains(&index)) {
                return Err(top.error_at("together", format!("names \"{name}\" twice; a node is in one process")));
            }
            group.push(index);
        }
        if group.len() < 2 {
            return Err(top.error_at("together", "needs the names of two or more nodes, such as [\"scaling\", \"canceller\"]"));
        }
        match obstacle(graph, &group) {
            Some(message) => return Err(top.error_at("together", message)),
            None => groups.push(group),
        }
    }
    Ok(groups)
}

/// Why these nodes cannot share a process, in one sentence.
fn obstacle(graph: &Graph, group: &[usize]) -> Option<String> {
    let nodes: Vec<&Node> = group.iter().map(|i| &graph.nodes[*i]).collect();
    let first = nodes.first()?;
    for node in &nodes {
        if node.kind == NodeKind::Recorder {
            return Some(format!("\"{}\" is a recorder, which receives every topic in its own process; remove it", node.name));
        }
        if node.command.is_some() {
            return Some(format!("\"{}\" is an external program (command), which needs its own process; remove it", node.name));
        }
        if node.host != first.host {
            let host = |n: &Node| n.host.clone().unwrap_or_else(|| "any host".to_string());
            let (a, b) = (&first.name, &node.name);
            return Some(format!("\"{a}\" runs on {} and \"{b}\" on {}: a process runs on one host", host(first), host(node)));
        }
        if node.restart != first.restart {
            let (with, without) = if node.restart { (node, first) } else { (first, node) };
            let told = "both or neither, for their process is started again as a whole";
            return Some(format!("\"{}\" has restart = true and \"{}\" does not: {told}", with.name, without.name));
        }
    }
    // Reached from the first along connections within the group, whichever way they lead.
    let mut reached = vec![group[0]];
    let mut next = 0;
    while let Some(here) = reached.get(next).copied() {
        for c in &graph.connections {
            for (a, b) in [(c.from.0, c.to.0), (c.to.0, c.from.0)] {
                if a == here && group.contains(&b) && !reached.contains(&b) {
                    reached.push(b);
                }
            }
        }
        next += 1;
    }
    let apart = group.iter().find(|i| !reached.contains(i))?;
    let others: Vec<&str> = nodes.iter().filter(|n| n.name != graph.nodes[*apart].name).map(|n| n.name.as_str()).collect();
    Some(format!(
        "no connection joins \"{}\" with {}: nodes that share a process must follow one another",
        graph.nodes[*apart].name,
        others.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(" or ")
    ))
}

impl Graph {
    /// The nodes of the process that a node runs in: itself, or all of its [`Graph::together`], the one that leads them first.
    pub fn process_of(&self, name: &str) -> Vec<&Node> {
        let Some(index) = self.nodes.iter().position(|n| n.name == name) else { return Vec::new() };
        match self.together.iter().find(|group| group.contains(&index)) {
            Some(group) => group.iter().map(|i| &self.nodes[*i]).collect(),
            None => vec![&self.nodes[index]],
        }
    }
}
