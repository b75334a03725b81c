//! How the nodes of a run are carried out: in this process, or each in its own.

use crate::done::{Done, lost_device};
use crate::error::RunError;
use crate::watch::Watch;
use backdrive_bags::{Completeness, Reader, Recorder, RecorderOptions, check_target};
use backdrive_launch::asked::{Meeting, place};
use backdrive_launch::join::{recorder_options, recording};
use backdrive_launch::{Cause, Place, RunReport, SuperviseOptions, Wire};
use backdrive_msgs::Message;
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_nodes::sequence::Sequence;
use backdrive_nodes::stage::Clock;
use backdrive_nodes::transport::ros2::Courier;
use backdrive_stability::summary::{SummaryError, Traces, summarise};
use backdrive_stability::unjudged::Unjudged;
use std::path::Path;
use std::time::{Duration, Instant};

/// How the nodes of a run are carried out.
pub enum Way {
    /// In this process.
    Here,
    /// Each as a process of its own, which meet at this place.
    Processes(Place),
}

/// How messages travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// A process for each node, over shared memory.
    Iceoryx2,
    /// A process for each node, over ROS 2 (DDS).
    Ros2,
    /// All nodes in this process.
    Inproc,
}

impl Way {
    /// By the options; without a transport shared memory on one host, else ROS 2. `meeting` states no wire.
    ///
    /// # Errors
    /// Host, secret or network contradict the transport or the graph.
    pub fn of(graph: &Graph, transport: Option<Transport>, meeting: Meeting) -> Result<Way, RunError> {
        let wire = match transport {
            Some(Transport::Inproc) if meeting.host.is_some() => {
                return Err(RunError::input("--transport inproc is for one host; omit --host"));
            }
            Some(Transport::Inproc) if meeting.secret.is_some() => {
                return Err(RunError::input("--secret is for several hosts; omit it without --host"));
            }
            Some(Transport::Inproc) => return Ok(Way::Here),
            Some(Transport::Iceoryx2) => Some(Wire::Iceoryx2),
            Some(Transport::Ros2) => Some(Wire::Ros2),
            None => None,
        };
        Ok(Way::Processes(place(graph, &Meeting { wire, ..meeting })?))
    }
}

/// Whether every node of ours can be built: reported before a process is started, and once.
///
/// # Errors
/// The first node that cannot be built.
pub fn buildable(graph: &Graph) -> Result<(), RunError> {
    for node in graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder && n.command.is_none()) {
        plan(graph, &node.name).map_err(|e| RunError::input(format!("{}: {e}", graph.path.display())))?;
    }
    Ok(())
}

/// Runs one graph to its end.
///
/// # Errors
/// A node cannot be built, the bag cannot be written, or this machine does not let the nodes run.
pub fn run_graph(graph: &Graph, way: &Way, watch: &dyn Watch) -> Result<Done, RunError> {
    match way {
        Way::Processes(place) => run_processes(graph, place, watch),
        Way::Here => run_here(graph, watch, &mut |_, _| {}),
    }
}

/// Reports what would stop a run before it begins.
fn ready(graph: &Graph, host: Option<&str>) -> Result<(), RunError> {
    buildable(graph)?;
    // A run that ends with its last step, for a bag that cannot be written, would be lost whole.
    graph.bag_of(host).map_or(Ok(()), |bag| check_target(&bag, graph.overwrite).map_err(RunError::Bag))
}

/// How long hosts may take to find each other: somebody walks from one to the other.
const HOSTS_TIMEOUT: Duration = Duration::from_secs(120);

/// Who waits by looking takes a processor from whom it waits for, where they share one.
fn too_many_poll(graph: &Graph, host: Option<&str>, watch: &dyn Watch) {
    let here = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder && host.is_none_or(|host| graph.runs_on(n, host)));
    let processes = here.filter(|n| graph.process_of(&n.name).first().is_some_and(|first| first.name == n.name)).count();
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    if graph.polls && processes > processors {
        watch.note(&format!(
            "warning: wait = \"poll\" keeps a processor busy for each process, and {processes} processes share {processors}: the loop \
             will be slow; remove it, or let nodes share a process (together)"
        ));
    }
}

fn run_processes(graph: &Graph, place: &Place, watch: &dyn Watch) -> Result<Done, RunError> {
    ready(graph, place.host.as_deref())?;
    too_many_poll(graph, place.host.as_deref(), watch);
    let courier = Courier::start(&place.network).map_err(RunError::machine)?;
    let mut options = SuperviseOptions { node_command: watch.node_command(), created: watch.created(), ..SuperviseOptions::default() };
    if place.host.is_some() {
        options.ready_timeout = HOSTS_TIMEOUT;
    }
    let place = Place { overwrite: graph.overwrite, ..place.clone() };
    let report = backdrive_launch::run(graph, &place, options)?;
    drop(courier);
    let bag = report.bag.clone().filter(|bag| bag.exists());
    // What is known of the run is reported even where its bag cannot be read.
    let read = bag.as_ref().map(|bag| {
        let _reading = watch.begins(&format!("reading {}", bag.display()));
        (summarise(bag), whole(bag))
    });
    let (summary, (complete, mut unreadable)) = read.map_or((None, (false, None)), |(summary, whole)| (Some(summary), whole));
    let warn = |e: SummaryError| watch.note(&format!("warning: {e}"));
    let mut summary = summary.and_then(|summary| summary.map_err(warn).ok());
    if report.bag.as_deref().is_some_and(|bag| !bag.exists()) {
        unreadable = Some("no longer exists".to_string());
    }
    let lost = report.lost + report.unrecorded.unwrap_or(0);
    if let Some(summary) = &mut summary {
        summary.hold_back(fault(&report, lost));
    }
    Ok(Done { steps: report.steps, duration_s: report.duration_s, lost, bag, complete, unreadable, summary, report: Some(report) })
}

/// Whether a run's bag was ended and nothing is missing in it, and what keeps it from being read.
fn whole(bag: &Path) -> (bool, Option<String>) {
    match Reader::open(bag) {
        Ok(reader) => {
            let complete = reader.ended_cleanly() && reader.completeness().is_some_and(Completeness::is_complete);
            let broken = || reader.messages().map_or_else(|e| Some(e.to_string()), |mut m| m.find_map(|e| e.err().map(|e| e.to_string())));
            let unreadable = reader.damage().first().cloned().or_else(broken);
            (complete && unreadable.is_none(), unreadable)
        }
        Err(error) => (false, Some(error.to_string())),
    }
}

/// Why a run must not be called stable, whatever its signals look like.
fn fault(report: &RunReport, lost: u64) -> Option<Unjudged> {
    let died = matches!(report.cause, Cause::NodeDied { .. } | Cause::NodeFailed { .. } | Cause::EndedEarly { .. });
    if died || !report.deaths.is_empty() || lost_device(report).is_some() {
        return Some(Unjudged::NodeDied);
    }
    (lost > 0).then_some(Unjudged::Lost { messages: lost })
}

/// Runs a graph in this process, in lockstep; `hear` gets every message with its topic. As with processes, its bag has its name from the
/// beginning: what was recorded survives a run that is cut short.
///
/// # Errors
/// The graph cannot run in one process, a node cannot be built, or the bag cannot be written.
pub fn run_here(graph: &Graph, watch: &dyn Watch, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, RunError> {
    in_this_process(graph, false, watch, hear)
}

/// The same for what can be repeated: its bag is there whole or not at all.
///
/// # Errors
/// As [`run_here`].
pub fn repeat_here(graph: &Graph, watch: &dyn Watch, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, RunError> {
    in_this_process(graph, true, watch, hear)
}

fn in_this_process(graph: &Graph, all_or_nothing: bool, watch: &dyn Watch, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, RunError> {
    if graph.timing.clock == Clock::Realtime {
        return Err(RunError::input("one process runs in lockstep only; use --clock lockstep, or --transport iceoryx2"));
    }
    let Some(steps) = graph.timing.steps else {
        return Err(RunError::input(format!("{}: needs a duration_s to run in one process", graph.path.display())));
    };
    if let Some(node) = graph.nodes.iter().find(|n| n.command.is_some()) {
        return Err(RunError::input(format!(
            "node \"{}\" is an external program, which cannot run in the same process; run it with --transport iceoryx2",
            node.name
        )));
    }
    ready(graph, None)?;
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(graph, &n.name));
    let mut sequence = Sequence::new(plans.collect::<Result<_, _>>()?, &graph.timing).map_err(RunError::input)?;
    let (record, header) = recording(graph, "recorder", None);
    let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
    let place: Vec<Option<usize>> = names.iter().map(|name| record.topics.iter().position(|t| t.name == *name)).collect();
    let mut recorder = match &graph.bag {
        Some(bag) => {
            let options = RecorderOptions { whole: all_or_nothing, ..recorder_options(graph) };
            Some(Recorder::create(bag, &header, &options).map_err(RunError::Bag)?)
        }
        None => None,
    };
    watch.steps(&graph.title, 0, steps);
    let mut traces = Traces::of(graph);
    let (started, mut failed, mut told) = (Instant::now(), None, Vec::new());
    let mut done = 0;
    while done < steps && failed.is_none() {
        let some = (steps - done).min(512);
        let mut tap = |topic: usize, message: &Message| {
            traces.take(&names[topic], message);
            if let Message::Event(event) = message
                && event.severity > 0
            {
                told.push(format!("{}: step {}: {}", names[topic], event.step, event.text.as_str()));
            }
            hear(&names[topic], message);
            if let (Some(recorder), Some(place)) = (&mut recorder, place[topic])
                && let Err(e) = recorder.push(place, *message, 0)
            {
                failed.get_or_insert(e);
            }
        };
        sequence.run(some, Some(&mut tap));
        told.drain(..).for_each(|line| watch.note(&line));
        if let Some(recorder) = &mut recorder {
            recorder.checkpoint();
        }
        done += some;
        if done < steps {
            watch.steps(&graph.title, done, steps);
        }
    }
    watch.steps(&graph.title, steps, steps);
    let lost = match recorder.map(Recorder::finish).transpose() {
        Ok(completeness) => completeness.map_or(0, |c| c.lost()),
        Err(e) => return Err(RunError::machine(failed.unwrap_or(e))),
    };
    let mut summary = traces.summary(graph);
    summary.hold_back((lost > 0).then_some(Unjudged::Lost { messages: lost }));
    let summary = Some(summary);
    let unreadable = graph.bag.as_deref().and_then(|bag| whole(bag).1);
    Ok(Done {
        steps,
        duration_s: started.elapsed().as_secs_f64(),
        report: None,
        lost,
        complete: lost == 0 && unreadable.is_none(),
        unreadable,
        bag: graph.bag.clone(),
        summary,
    })
}
