//! Where the graph of a run comes from: a graph file, or a bag, whose graph is run again with the files that the bag holds.

use crate::error::RunError;
use backdrive_bags::{Reader, free};
use backdrive_nodes::graph::{Files, Graph, Overrides};
use backdrive_stability::summary::graph_of;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Reads the graph of a graph file or of a bag, with the command line's changes. A bag that the command line does not name gets a name that is free, so that
/// a run never meets the recording of an earlier one.
///
/// # Errors
/// When the file cannot be read, or is neither.
pub fn load(path: &Path, changes: &Overrides) -> Result<Graph, RunError> {
    let (graph, from_bag) = match is_bag(path) {
        true => (of_bag(path, changes)?, true),
        false => (Graph::load(path, changes)?, false),
    };
    // The hosts of one run name their bags together, so none of them may take another name.
    let Some(bag) = graph.bag.as_ref().filter(|_| changes.bag.is_none() && graph.hosts.is_empty()) else { return Ok(graph) };
    // The bag that is read is never the one that is written.
    let named = if bag.is_file() { free(bag) } else { bag.clone() };
    if named == *bag || changes.overwrite && !(from_bag && same(bag, path)) {
        return Ok(graph);
    }
    let changes = Overrides { bag: Some(named), ..changes.clone() };
    if from_bag { of_bag(path, &changes) } else { Ok(Graph::load(path, &changes)?) }
}

/// Whether the graph of a bag can be run from that bag alone: it names no programs of a user's own, of which the bag holds the names only.
pub fn runs_from_its_bag(graph: &Graph) -> bool {
    graph.nodes.iter().all(|node| node.command.is_none()) && graph.hosts.is_empty()
}

/// The graph of a bag, its files those that the bag holds, without the folders in which they lay.
fn of_bag(path: &Path, changes: &Overrides) -> Result<Graph, RunError> {
    let reader = Reader::open(path).map_err(RunError::input)?;
    let mut graph = graph_of(&reader, changes)?;
    if !runs_from_its_bag(&graph) {
        return Err(RunError::input(format!(
            "{}: its graph has external programs or several hosts, which a bag does not contain; run its graph file",
            path.display()
        )));
    }
    graph.record_origin = false;
    let (text, files) = graph.portable();
    let here = std::env::current_dir().unwrap_or_default();
    let bag = graph.bag.as_ref().map(|bag| changes.bag.clone().unwrap_or_else(|| PathBuf::from(bag.file_name().unwrap_or_default())));
    let again = Overrides { bag: bag.map(|bag| here.join(bag)), overwrite: changes.overwrite, ..Overrides::default() };
    Ok(Graph::from_text(&text, path, &again, &Files::Bag(&files))?)
}

/// Whether a file begins as a bag does.
fn is_bag(path: &Path) -> bool {
    let mut start = [0; 8];
    path.is_file() && File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == *b"\x89MCAP0\r\n"
}

fn same(a: &Path, b: &Path) -> bool {
    a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b)
}
