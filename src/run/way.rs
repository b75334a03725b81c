//! How the nodes of a run are carried out: in this process, or each in its own.

use super::done::Done;
use crate::cli::{self, Transport};
use crate::failure::Failure;
use crate::graph::buildable;
use crate::network::place;
use crate::{output, progress};
use backdrive_bags::{Completeness, Reader, Recorder, RecorderOptions, check_target};
use backdrive_launch::join::{recorder_options, recording};
use backdrive_launch::{Cause, Place, RunReport, SuperviseOptions, Wire};
use backdrive_msgs::Message;
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_nodes::sequence::Sequence;
use backdrive_nodes::stage::Clock;
use backdrive_nodes::transport::ros2::Courier;
use backdrive_stability::summary::{Traces, summarise};
use backdrive_stability::unjudged::Unjudged;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How the nodes of a run are carried out.
pub enum Way {
    /// In this process.
    Here,
    /// Each as a process of its own, which meet at this place.
    Processes(Place),
}

impl Way {
    /// What the command line asks for.
    pub(super) fn of(graph: &Graph, options: &cli::Run) -> Result<Way, Failure> {
        let wire = match options.transport {
            Some(Transport::Inproc) if options.host.is_some() => {
                return Err(Failure::input("--transport inproc is for one host; leave --host out"));
            }
            Some(Transport::Inproc) if options.secret.is_some() => {
                return Err(Failure::input("--secret is what several hosts share; leave it out without --host"));
            }
            Some(Transport::Inproc) => return Ok(Way::Here),
            Some(Transport::Iceoryx2) => Some(Wire::Iceoryx2),
            Some(Transport::Ros2) => Some(Wire::Ros2),
            None => None,
        };
        place(graph, wire, options.host.as_deref(), options.secret.as_deref(), &options.network).map(Way::Processes)
    }
}

/// Runs one graph to its end.
pub fn run_graph(graph: &Graph, way: &Way) -> Result<Done, Failure> {
    match way {
        Way::Processes(place) => run_processes(graph, place),
        Way::Here => run_here(graph, &mut |_, _| {}),
    }
}

/// Reports what would stop a run before it begins.
fn ready(graph: &Graph, host: Option<&str>) -> Result<(), Failure> {
    buildable(graph)?;
    // A run that ends with its last step, for a bag that cannot be written, would be lost whole.
    graph.bag_of(host).map_or(Ok(()), |bag| check_target(&bag, graph.overwrite).map_err(Failure::bag))
}

/// How long hosts may take to find each other: somebody walks from one to the other.
const HOSTS_TIMEOUT: Duration = Duration::from_secs(120);

/// Who waits by looking takes a processor from whom it waits for, where they share one.
fn too_many_poll(graph: &Graph, host: Option<&str>) {
    let here = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder && host.is_none_or(|host| graph.runs_on(n, host)));
    let processes = here.filter(|n| graph.process_of(&n.name).first().is_some_and(|first| first.name == n.name)).count();
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    if graph.polls && processes > processors {
        output::note(format_args!(
            "warning: wait = \"poll\" keeps a processor busy for each process, and {processes} processes share {processors}: the loop will be slow; \
             take it away, or let nodes share a process (together)"
        ));
    }
}

fn run_processes(graph: &Graph, place: &Place) -> Result<Done, Failure> {
    ready(graph, place.host.as_deref())?;
    too_many_poll(graph, place.host.as_deref());
    let courier = Courier::start(&place.network).map_err(Failure::machine)?;
    let mut options = SuperviseOptions::default();
    if place.host.is_some() {
        options.ready_timeout = HOSTS_TIMEOUT;
    }
    let place = Place { overwrite: graph.overwrite, ..place.clone() };
    let report = backdrive_launch::run(graph, &place, options)?;
    drop(courier);
    let bag = report.bag.clone().filter(|bag| bag.exists());
    // What is known of the run is reported even where its bag cannot be read.
    let read = |bag: &PathBuf| (summarise(bag), whole(bag));
    let read = bag.as_ref().map(|bag| progress::busy(&format!("reading {}", bag.display()), || read(bag)));
    let (summary, (complete, mut unreadable)) = read.map_or((None, (false, None)), |(summary, whole)| (Some(summary), whole));
    let told = |e: Failure| output::note(format_args!("warning: {}", e.message));
    let mut summary = summary.and_then(|summary| summary.map_err(|e| told(e.into())).ok());
    if report.bag.as_deref().is_some_and(|bag| !bag.exists()) {
        unreadable = Some("is not there any more".to_string());
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
pub(super) fn fault(report: &RunReport, lost: u64) -> Option<Unjudged> {
    let died = matches!(report.cause, Cause::NodeDied { .. } | Cause::NodeFailed { .. } | Cause::EndedEarly { .. });
    if died || !report.deaths.is_empty() {
        return Some(Unjudged::NodeDied);
    }
    (lost > 0).then_some(Unjudged::Lost { messages: lost })
}

/// Runs a graph in this process, in lockstep; `hear` gets every message with its topic. As with processes, its bag has its name from the
/// beginning: what was recorded survives a run that is cut short.
pub fn run_here(graph: &Graph, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, Failure> {
    in_this_process(graph, false, hear)
}

/// The same for what can be repeated: its bag is there whole or not at all.
pub fn repeat_here(graph: &Graph, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, Failure> {
    in_this_process(graph, true, hear)
}

fn in_this_process(graph: &Graph, all_or_nothing: bool, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, Failure> {
    if graph.timing.clock == Clock::Realtime {
        return Err(Failure::input("one process runs in lockstep only; use --clock lockstep, or --transport iceoryx2"));
    }
    let Some(steps) = graph.timing.steps else {
        return Err(Failure::input(format!("{}: needs a duration_s to run in one process", graph.path.display())));
    };
    if let Some(node) = graph.nodes.iter().find(|n| n.command.is_some()) {
        return Err(Failure::input(format!(
            "node \"{}\" is a program of its own, which one process cannot hold; run it with --transport iceoryx2",
            node.name
        )));
    }
    ready(graph, None)?;
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(graph, &n.name));
    let mut sequence = Sequence::new(plans.collect::<Result<_, _>>()?, &graph.timing).map_err(Failure::input)?;
    let (record, header) = recording(graph, "recorder", None);
    let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
    let place: Vec<Option<usize>> = names.iter().map(|name| record.topics.iter().position(|t| t.name == *name)).collect();
    let mut recorder = match &graph.bag {
        Some(bag) => {
            let options = RecorderOptions { whole: all_or_nothing, ..recorder_options(graph) };
            Some(Recorder::create(bag, &header, &options).map_err(Failure::bag)?)
        }
        None => None,
    };
    let bar = progress::steps(steps, &graph.title);
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
        bar.suspend(|| told.drain(..).for_each(|line| output::note(format_args!("{line}"))));
        if let Some(recorder) = &mut recorder {
            recorder.checkpoint();
        }
        done += some;
        bar.set_position(done);
    }
    bar.finish_and_clear();
    let lost = match recorder.map(Recorder::finish).transpose() {
        Ok(completeness) => completeness.map_or(0, |c| c.lost()),
        Err(e) => return Err(Failure::machine(failed.unwrap_or(e))),
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
