//! How a process becomes a node of a running graph: ours and a user's own alike.

use crate::orphaned;
use crate::paths::RunPaths;
use crate::place::{Place, Wire};
use backdrive_bags::{BagError, BagHeader, Recorder, RecorderOptions, TopicInfo};
use backdrive_control::core::Core;
use backdrive_nodes::build::{self, GraphTopic, credit_listeners, listeners_on, topics};
use backdrive_nodes::graph::{Files, Graph, Node, NodeKind, Overrides};
use backdrive_nodes::process::{ProcessOptions, run_processes};
use backdrive_nodes::protocol::FromNode;
use backdrive_nodes::realtime;
use backdrive_nodes::recorder::{RecorderPlan, run_recorder};
use backdrive_nodes::stage::Clock;
use std::collections::BTreeMap;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Below the nodes of the loop, so that it takes nothing from them; above everything else on the machine, so that nothing
/// else keeps it from taking samples over in time.
const RECORDER_PRIORITY: i32 = 40;

/// Just below the loop, which must not wait for it, and which it wakes.
const MIDDLEWARE_PRIORITY: i32 = 49;

/// Joins a run as a node of the user's own, with the arguments that the supervisor gives (`--run DIR --name NAME`),
/// and runs it to its end. `cores` gets the graph and the node and brings one core per stage of the node's kind.
pub fn join<F>(cores: F) -> ExitCode
where
    F: FnOnce(&Graph, &Node) -> Result<Vec<Box<dyn Core>>, String>,
{
    let arguments: Vec<String> = std::env::args().collect();
    let after = |flag: &str| arguments.iter().position(|a| a == flag).and_then(|i| arguments.get(i + 1)).cloned();
    match (after("--run"), after("--name")) {
        (Some(run), Some(name)) => join_run(Path::new(&run), &name, cores),
        _ => fail("this program is a node of a graph: name it as `command` of a node, and `backdrive run` starts it".to_string(), 2),
    }
}

/// Joins a run as a node whose cores the caller brings.
pub(crate) fn join_run<F>(run: &Path, name: &str, cores: F) -> ExitCode
where
    F: FnOnce(&Graph, &Node) -> Result<Vec<Box<dyn Core>>, String>,
{
    run_node(run, name, |graph, node| build::plan_with(graph, &node.name, cores(graph, node)?).map_err(|e| e.to_string()))
}

/// Joins a run as one of our own nodes.
pub fn join_as(run: &Path, name: &str) -> ExitCode {
    run_node(run, name, |graph, node| build::plan(graph, &node.name).map_err(|e| e.to_string()))
}

fn run_node<P>(run: &Path, name: &str, plan: P) -> ExitCode
where
    P: FnOnce(&Graph, &Node) -> Result<backdrive_nodes::stage::NodePlan, String>,
{
    let paths = match RunPaths::open(run) {
        Ok(paths) => paths,
        Err(e) => return fail(e.to_string(), 5),
    };
    if let Err(e) = orphaned::take_part(&paths) {
        return fail(e, 5);
    }
    let place = match Place::read(&paths) {
        Ok(place) => place,
        Err(e) => return fail(e, 5),
    };
    let graph = match read_graph(&paths) {
        // Started without a host, all of it runs on this one.
        Ok(graph) if place.host.is_none() => graph.on_one_host(),
        Ok(graph) => graph,
        Err(e) => return fail(e, 3),
    };
    let Some(node) = graph.node(name) else { return fail(format!("the graph has no node \"{name}\""), 3) };
    if graph.timing.clock == Clock::Realtime && place.wire == Wire::Ros2 {
        // Before the middleware's threads are made, which inherit it. The node reports later what is refused here.
        let _ = realtime::enter(&realtime::Options { priority: Some(MIDDLEWARE_PRIORITY), ..realtime::Options::default() });
    }
    let transport = match place.join(&paths, &graph, name) {
        Ok(transport) => transport,
        Err(e) => return fail(e.to_string(), 5),
    };
    if node.kind == NodeKind::Recorder {
        if graph.timing.clock == Clock::Realtime && !(graph.polls && realtime::is_throttled()) {
            // Not above nodes that poll in the ordinary class: it would take their processors even where another is idle.
            // Before its writer's thread is made, which inherits it. What is refused here is refused to the other nodes
            // too, and they say so.
            let _ = realtime::enter(&realtime::Options { priority: Some(RECORDER_PRIORITY), ..realtime::Options::default() });
        }
        let (plan, header) = recording(&graph, name, place.host.as_deref());
        let path = graph.bag_of(place.host.as_deref()).unwrap_or_else(|| PathBuf::from("run.mcap"));
        let options = RecorderOptions { overwrite: place.overwrite, ..recorder_options(&graph) };
        return match Recorder::create(&path, &header, &options) {
            Ok(recorder) => run_recorder(&plan, &graph.timing, transport, Box::new(recorder)),
            // Another run was faster since the supervisor looked.
            Err(e @ (BagError::Exists { .. } | BagError::InUse { .. })) => fail(e.to_string(), 3),
            Err(e) => fail(e.to_string(), 5),
        };
    }
    // A program of the user's own is never with others.
    let others = graph.process_of(name).into_iter().filter(|n| n.name != name);
    let others = others.map(|n| build::plan(&graph, &n.name).map_err(|e| e.to_string()));
    let plans: Vec<_> = match std::iter::once(plan(&graph, node)).chain(others).collect::<Result<_, _>>() {
        Ok(plans) => plans,
        Err(e) => return fail(e, 3),
    };
    let mut options = ProcessOptions::default();
    let expected = |t: GraphTopic| {
        let listeners = match (place.wire, &place.host) {
            // In shared memory the bridge listens for all nodes on other hosts.
            (Wire::Iceoryx2, Some(host)) => {
                let here = listeners_on(&graph, &t.topic, host);
                here + usize::from(here < t.listeners)
            }
            (Wire::Iceoryx2, None) | (Wire::Ros2, _) => t.listeners,
        };
        (t.topic.name, listeners)
    };
    options.run.polls = graph.polls;
    if graph.polls && realtime::is_throttled() {
        // A SCHED_FIFO thread that never sleeps loses its processor for 50 ms of each second: the ordinary one does better.
        options.realtime.priority = None;
    }
    options.run.listeners = topics(&graph).into_iter().map(expected).collect();
    run_processes(plans, &graph.timing, transport, options)
}

/// The graph of a run as its processes read it: the resolved text, and the files as they were when the run began.
///
/// # Errors
/// It cannot be read, or no longer is a graph.
pub fn read_graph(paths: &RunPaths) -> Result<Graph, String> {
    let path = paths.graph();
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: cannot be read: {e}", path.display()))?;
    Graph::from_text(&text, &path, &Overrides::default(), &Files::Disk).map_err(|e| e.to_string())
}

/// What a recorder of this graph hears, on this of its hosts if it has some, and its bag's description of the run.
pub fn recording(graph: &Graph, name: &str, host: Option<&str>) -> (RecorderPlan, BagHeader) {
    let topics = topics(graph);
    let credit = (graph.timing.clock == Clock::Lockstep).then(|| (build::credit_topic(host), credit_listeners(graph)));
    let heard = topics.iter().map(|t| t.topic.clone()).collect();
    let plan = RecorderPlan { name: name.to_string(), topics: heard, credit, by_wall_clock: host.is_some() };
    let (graph_toml, files) = graph.portable();
    let header = BagHeader {
        title: graph.title.clone(),
        graph_toml,
        files,
        versions: BTreeMap::from([("backdrive".to_string(), env!("CARGO_PKG_VERSION").to_string())]),
        seeds: BTreeMap::from([("graph".to_string(), graph.seed)]),
        clock: match graph.timing.clock {
            Clock::Lockstep => backdrive_bags::Clock::Lockstep,
            Clock::Realtime => backdrive_bags::Clock::Realtime,
        },
        rate_hz: graph.timing.rate_hz,
        // Hosts of a graph are called as its author likes, and merging needs to know them.
        host: host.map_or_else(|| if graph.record_origin { self::host() } else { String::new() }, str::to_string),
        topics: topics.into_iter().map(|t| TopicInfo { topic: t.topic, axes: t.axes, publisher: t.publisher }).collect(),
        ..BagHeader::default()
    };
    (plan, header)
}

/// How a graph's bag is written. One that exists is replaced only where the graph was read with leave to do so.
pub fn recorder_options(graph: &Graph) -> RecorderOptions {
    let options = match graph.timing.clock {
        Clock::Lockstep => RecorderOptions::lockstep(),
        Clock::Realtime => RecorderOptions::default(),
    };
    RecorderOptions { overwrite: graph.overwrite, ..options }
}

/// Name of this machine.
fn host() -> String {
    std::fs::read_to_string("/proc/sys/kernel/hostname").map(|s| s.trim().to_string()).unwrap_or_default()
}

/// Reports why the node cannot begin, to the supervisor, or to the user who started it by hand.
/// Reports to the supervisor why this node ends, with the exit code of the command line; returns that code.
pub(crate) fn fail(error: String, code: u8) -> ExitCode {
    let line = serde_json::to_string(&FromNode::Failed { error: error.clone(), code });
    // A supervisor that is gone hears nothing, and that is no second error.
    let _ = writeln!(std::io::stdout(), "{}", line.unwrap_or_default());
    // The supervisor has heard it, and shows it with the node's name.
    if code == 2 || std::io::stdout().is_terminal() || std::io::stderr().is_terminal() {
        let _ = writeln!(std::io::stderr(), "{error}");
    }
    ExitCode::from(code)
}
