//! Reads a graph file and the files that it names.

mod connection;
mod device;
mod experiment;
mod gains;
mod node;
mod played;

use super::files::{Files, Sources};
use super::hosts::read_hosts;
use super::overrides::experiment_text;
use super::together::read_together;
use super::{Graph, Overrides, check};
use crate::stage::{Clock, Timing};
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table, read_text};
use connection::{read_connection, settle_axes};
use device::NodeReader;
use experiment::{in_experiment, read_experiment};
use gains::read_gains;
use std::path::{Path, PathBuf};

/// Where a graph does not state it: a force is zero at most 20 ms after a node of its loop died, s.
const STALE_AFTER_S: f64 = 0.01;

/// Highest rate of a graph, Hz.
pub const MAX_RATE_HZ: f64 = 10_000.0;

impl Graph {
    /// Reads a graph file, changes it as the command line asks, and checks it.
    pub fn load(path: &Path, changes: &Overrides) -> Result<Graph, FileError> {
        Graph::from_text(&read_text(path)?, path, changes, &Files::Disk)
    }

    /// One experiment of a graph file that has some: a graph of its own, in which the experiment's keys stand in
    /// place of the nodes' and the length of the run.
    pub fn load_experiment(path: &Path, changes: &Overrides, experiment: &str) -> Result<Graph, FileError> {
        let whole = read_text(path)?;
        let text = experiment_text(&whole, experiment);
        Graph::from_text(&text, path, changes, &Files::Disk).map_err(|e| in_experiment(e, &whole, path, experiment))
    }

    /// The same from text, such as a bag holds; `path` is where its relative paths start and what errors name.
    pub fn from_text(text: &str, path: &Path, changes: &Overrides, files: &Files) -> Result<Graph, FileError> {
        let text = changes.apply(text, path, files)?;
        let mut top = Table::parse(text.as_str(), path.display().to_string())?;
        let title = top.string("title")?.unwrap_or_default();
        let rate_hz = top.need_number("rate_hz", Range::Positive)?;
        if rate_hz > MAX_RATE_HZ {
            return Err(top.error_at("rate_hz", format!("must be at most {MAX_RATE_HZ}, is {rate_hz}")));
        }
        let clock = top.one_of("clock", &Clock::ALL)?.unwrap_or_default();
        let steps = top.number("duration_s", Range::Positive)?.map(|s| (s * rate_hz).round().max(1.0) as u64);
        let seed = top.integer("seed", 0, i64::MAX)?.unwrap_or(1) as u64;
        let peer_timeout_s = top.number_or("peer_timeout_s", Range::Positive, 10.0)?;
        let gains = read_gains(&mut top)?;
        let stale_after_s = match top.table("safety")? {
            None => STALE_AFTER_S,
            Some(mut safety) => {
                let stale_after_s = safety.number_or("stale_after_s", Range::Positive, STALE_AFTER_S)?;
                safety.finish()?;
                stale_after_s
            }
        };
        let mut graph = Graph {
            title,
            text: text.clone(),
            path: path.to_path_buf(),
            timing: Timing { rate_hz, clock, steps, peer_timeout_s },
            seed,
            gains,
            stale_after_s,
            bag: None,
            overwrite: changes.overwrite,
            record_origin: top.boolean("record_origin")?.unwrap_or(false),
            hosts: read_hosts(&mut top)?,
            nodes: Vec::new(),
            connections: Vec::new(),
            together: Vec::new(),
            polls: top.one_of("wait", &[("sleep", false), ("poll", true)])?.unwrap_or(false),
            files: Vec::new(),
            experiments: Vec::new(),
        };
        let sources = Sources { files, chosen: changes.chosen_files(), of: path.display().to_string() };
        let mut reader = NodeReader { files: &sources, graph: &mut graph };
        for table in top.tables("nodes")? {
            reader.read(table)?;
        }
        for table in top.tables("experiments")? {
            let experiment = read_experiment(table, &graph)?;
            graph.experiments.push(experiment);
        }
        let mut connections = Vec::new();
        for table in top.tables("connections")? {
            connections.push(read_connection(table, &graph)?);
        }
        graph.connections = connections;
        for index in 0..graph.connections.len() {
            let (node, port) = graph.connections[index].from.clone();
            graph.connections[index].topic = graph.topic_of(node, &port);
        }
        settle_axes(&mut graph);
        graph.together = read_together(&mut top, &graph)?;
        check::check(&graph, &top)?;
        top.finish()?;
        Ok(graph)
    }

    /// Where the run's files are named relative to.
    pub fn folder(&self) -> PathBuf {
        self.path.parent().map(Path::to_path_buf).unwrap_or_default()
    }
}
