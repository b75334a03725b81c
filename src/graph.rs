//! `backdrive check` and `backdrive graph`.

use crate::cli;
use crate::failure::Failure;
use crate::output;
use backdrive_nodes::build::topics;
use backdrive_nodes::graph::{Graph, Overrides, draw as draw_graph};
use backdrive_runs::way::buildable;

/// Loads a graph and every experiment of it, and builds every node, so that what would stop a run is reported now.
pub fn check(options: &cli::Graph) -> Result<u8, Failure> {
    let graph = Graph::load(&options.graph, &Overrides::default())?;
    let mut graphs = Vec::new();
    for experiment in &graph.experiments {
        graphs.push(Graph::load_experiment(&options.graph, &Overrides::default(), &experiment.name)?);
    }
    for each in std::iter::once(&graph).chain(&graphs) {
        buildable(each)?;
    }
    let experiments = if graphs.is_empty() { String::new() } else { format!(", {} experiments", graphs.len()) };
    output::line(format_args!(
        "{}: fine: {} nodes, {} connections, {} topics{experiments}",
        options.graph.display(),
        graph.nodes.len(),
        graph.connections.len(),
        topics(&graph).len()
    ))?;
    Ok(0)
}

/// Draws a graph as text.
pub fn draw(options: &cli::Graph) -> Result<u8, Failure> {
    output::text(draw_graph(&Graph::load(&options.graph, &Overrides::default())?))?;
    Ok(0)
}
