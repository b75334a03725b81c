//! A loop with another law between master and slave.

use backdrive_control::coupling::LawKind;
use backdrive_nodes::graph::{Connection, Files, Graph, NodeKind, Overrides, Settings};

/// Lets `law` couple the master and the slave of a graph, instead of scaling and canceller. What delays and impairs the ways in this graph lies on the link
/// then. A graph that cannot be read again, or has no scaling, stays unchanged.
pub fn couple(graph: &mut Graph, law: LawKind) {
    let changes = Overrides { coupling: Some(law), ..Overrides::default() };
    let Ok(mut coupled) = Graph::from_text(&graph.text, &graph.path, &changes, &Files::Bag(&graph.files)) else { return };
    let way = |to: NodeKind, port: &str| -> Option<&Connection> {
        graph.connections.iter().find(|c| graph.nodes[c.to.0].kind == to && c.to.1 == port)
    };
    let ways = [
        ("from_near", way(NodeKind::Slave, "command")),
        ("from_far", way(NodeKind::Scaling, "contact")),
        ("force", way(NodeKind::Master, "force")),
    ];
    for connection in &mut coupled.connections {
        if let Some((_, Some(was))) = ways.iter().find(|(port, _)| *port == connection.to.1) {
            connection.impairment = was.impairment;
        }
    }
    // The devices as they are now, which the text does not know.
    for node in &mut coupled.nodes {
        let now = graph.nodes.iter().find(|n| n.name == node.name);
        match (&mut node.settings, now.map(|n| &n.settings)) {
            (Settings::Canceller(files, ..), _) => files.model = None,
            (settings @ (Settings::Master(_) | Settings::Slave(_) | Settings::Operator(_)), Some(now)) => *settings = now.clone(),
            _ => {}
        }
    }
    (coupled.gains, coupled.timing, coupled.seed) = (graph.gains.clone(), graph.timing.clone(), graph.seed);
    *graph = coupled;
}
