//! `backdrive run` and `backdrive clean`.

use crate::cli::{self, Transport};
use crate::failure::{Failure, code};
use crate::graph::buildable;
use crate::network::place;
use crate::output;
use crate::progress;
use crate::summary::{Summary, Traces, summarise};
use backdrive_bags::{Completeness, Reader, Recorder, check_target};
use backdrive_launch::join::{recorder_options, recording};
use backdrive_launch::{Cause, Place, RunHome, RunReport, SuperviseOptions};
use backdrive_msgs::Message;
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind};
use backdrive_nodes::sequence::Sequence;
use backdrive_nodes::stage::Clock;
use backdrive_nodes::transport::ros2::Courier;
use backdrive_report::percent;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::unjudged::Unjudged;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Runs a graph, or each experiment of one.
pub fn run(options: &cli::Run) -> Result<u8, Failure> {
    let changes = options.changes.overrides(options.clock);
    let mut graph = Graph::load(&options.graph, &changes)?;
    if options.host.is_none() {
        graph = graph.on_one_host();
    }
    let way = Way::of(&graph, options)?;
    if !graph.experiments.is_empty() {
        return crate::experiments::run(options, &way, &graph, &changes);
    }
    if options.out.is_some() {
        return Err(Failure::input(format!("{}: has no [[experiments]], so --out means nothing here; use --bag", options.graph.display())));
    }
    if let Some(html) = &options.html {
        output::writable(html)?;
    }
    let mut heard = crate::run_page::Heard::of(&graph);
    let done = match &way {
        // What goes by is all there is where no bag is recorded.
        Way::Here if options.html.is_some() => run_here(&graph, &mut |topic, message| heard.take(topic, message))?,
        _ => run_graph(&graph, &way)?,
    };
    if let Some(html) = &options.html {
        if let (Way::Processes(_), Some(bag)) = (&way, &done.bag) {
            heard = crate::run_page::Heard::from_bag(&graph, bag)?;
        }
        output::file(html, crate::run_page::page(&done, &graph, &heard, None).html())?;
        output::note(format_args!("wrote {}", html.display()));
    }
    if options.json {
        output::line(done.json())?;
    } else {
        output::line(done.text())?;
    }
    Ok(done.exit_code())
}

/// What a run gave.
pub struct Done {
    /// Steps done by the node that did most.
    pub steps: u64,
    /// Wall-clock time, s.
    pub duration_s: f64,
    /// From the supervisor; `None` for a run in one process.
    pub report: Option<RunReport>,
    /// Messages that are not in the bag, and samples that a node did not get.
    pub lost: u64,
    /// The bag, if one was recorded.
    pub bag: Option<PathBuf>,
    /// Whether its recorder ended and nothing is missing in it.
    pub complete: bool,
    /// Why the bag cannot be read, where it cannot.
    pub unreadable: Option<String>,
    /// What happened.
    pub summary: Option<Summary>,
}

/// How the nodes of a run are carried out.
pub enum Way {
    /// In this process.
    Here,
    /// Each as a process of its own, which meet at this place.
    Processes(Place),
}

impl Way {
    /// What the command line asks for.
    fn of(graph: &Graph, options: &cli::Run) -> Result<Way, Failure> {
        match options.transport {
            Some(Transport::Inproc) if options.host.is_some() => {
                Err(Failure::input("--transport inproc is for one host; leave --host out"))
            }
            Some(Transport::Inproc) => Ok(Way::Here),
            given => place(graph, given, options.host.as_deref(), &options.network).map(Way::Processes),
        }
    }
}

/// Runs one graph to its end.
pub fn run_graph(graph: &Graph, way: &Way) -> Result<Done, Failure> {
    match way {
        Way::Processes(place) => run_processes(graph, place),
        Way::Here => run_here(graph, &mut |_, _| {}),
    }
}

/// What would stop a run is told before it begins.
fn ready(graph: &Graph, host: Option<&str>) -> Result<(), Failure> {
    buildable(graph)?;
    // A run that ends with its last step, for a bag that cannot be written, would be lost whole.
    graph.bag_of(host).map_or(Ok(()), |bag| check_target(&bag, graph.overwrite).map_err(Failure::bag))
}

/// How long hosts may take to find each other: somebody walks from one to the other.
const HOSTS_TIMEOUT: Duration = Duration::from_secs(120);

fn run_processes(graph: &Graph, place: &Place) -> Result<Done, Failure> {
    ready(graph, place.host.as_deref())?;
    let courier = Courier::start(&place.network).map_err(Failure::machine)?;
    let mut options = SuperviseOptions::default();
    if place.host.is_some() {
        options.ready_timeout = HOSTS_TIMEOUT;
    }
    let place = Place { overwrite: graph.overwrite, ..place.clone() };
    let report = backdrive_launch::run(graph, &place, options)?;
    drop(courier);
    let bag = report.bag.clone().filter(|bag| bag.exists());
    // What is known of the run is told even where its bag cannot be read.
    let read = |bag: &PathBuf| (summarise(bag), whole(bag));
    let read = bag.as_ref().map(|bag| progress::busy(&format!("reading {}", bag.display()), || read(bag)));
    let (summary, (complete, mut unreadable)) = read.map_or((None, (false, None)), |(summary, whole)| (Some(summary), whole));
    let told = |e: Failure| output::note(format_args!("warning: {}", e.message));
    let mut summary = summary.and_then(|summary| summary.map_err(told).ok());
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
fn fault(report: &RunReport, lost: u64) -> Option<Unjudged> {
    let died = matches!(report.cause, Cause::NodeDied { .. } | Cause::NodeFailed { .. } | Cause::EndedEarly { .. });
    if died || !report.deaths.is_empty() {
        return Some(Unjudged::NodeDied);
    }
    (lost > 0).then_some(Unjudged::Lost { messages: lost })
}

/// Runs a graph in this process, in lockstep; `hear` gets every message with its topic.
pub fn run_here(graph: &Graph, hear: &mut dyn FnMut(&str, &Message)) -> Result<Done, Failure> {
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
        Some(bag) => Some(Recorder::create(bag, &header, &recorder_options(graph)).map_err(Failure::bag)?),
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

impl Done {
    /// 0 stable, or nothing was asked of a loop; 1 not stable, 7 it cannot be told; before these, of a run that did not go as it should:
    /// 4 lost data, 6 a node failed, 130 interrupted.
    pub fn exit_code(&self) -> u8 {
        match (self.fault_code(), self.summary.as_ref().and_then(|s| s.outcome)) {
            (0, None | Some(Outcome::Stable)) => 0,
            (0, Some(Outcome::NotJudged { .. })) => code::CANNOT_TELL,
            (0, Some(Outcome::LimitCycle { .. } | Outcome::Unstable { .. } | Outcome::Limited { .. })) => code::NEGATIVE,
            (fault, _) => fault,
        }
    }

    /// How it went, whatever the loop did: 0 fine, 4 lost data, 6 a node failed, 130 interrupted.
    pub fn fault_code(&self) -> u8 {
        if let Some(report) = &self.report {
            match &report.cause {
                Cause::NodeFailed { code, .. } if *code != 0 => return *code,
                Cause::NodeDied { .. } | Cause::NodeFailed { .. } | Cause::EndedEarly { .. } => return code::NODE,
                Cause::Stopped { .. } => return code::INTERRUPTED,
                Cause::Completed if !report.orderly() => return code::NODE,
                Cause::Completed => {}
            }
        }
        if self.lost > 0 || self.unreadable.is_some() { code::LOST_DATA } else { 0 }
    }

    /// A few lines for a person.
    pub fn text(&self) -> String {
        let mut lines = Vec::new();
        let rate = self.steps as f64 / self.duration_s;
        let rate = if rate.is_finite() { format!(": {rate:.0} steps/s") } else { String::new() };
        lines.push(format!("ran      {} steps in {:.3} s{rate}", self.steps, self.duration_s));
        if let Some(report) = &self.report {
            lines.extend(timing(report));
            if report.cause != Cause::Completed {
                lines.push(format!("ended    {}", report.cause));
            }
            let told = match &report.cause {
                Cause::NodeDied { node, .. } | Cause::NodeFailed { node, .. } => node.as_str(),
                _ => "",
            };
            for death in report.deaths.iter().filter(|d| d.node != told || d.recovered) {
                lines.push(format!("died     {} {} at {:.3} s", death.node, death.how, death.t_s));
            }
        }
        if let Some(summary) = &self.summary {
            lines.push(summary.text());
        }
        if let Some(bag) = &self.bag {
            let complete = match self.lost {
                _ if self.unreadable.is_some() => "cannot be read".to_string(),
                0 if self.complete => "complete".to_string(),
                0 => "cut off; `backdrive bag recover` makes a clean copy of what it holds".to_string(),
                lost => format!("{lost} messages lost"),
            };
            lines.push(format!("bag      {} ({complete})", bag.display()));
        }
        if let Some(why) = &self.unreadable {
            lines.push(format!("UNREADABLE {why}"));
        }
        lines.retain(|l| !l.is_empty());
        lines.join("\n")
    }

    /// For scripts.
    pub fn json(&self) -> serde_json::Value {
        let report = self.report.as_ref();
        let summary = self.summary.as_ref();
        json!({
            "steps": self.steps,
            "duration_s": self.duration_s,
            "steps_per_s": (self.duration_s > 0.0).then(|| self.steps as f64 / self.duration_s),
            "loop_p50_us": report.and_then(|r| r.loop_p50_us),
            "loop_p99_us": report.and_then(|r| r.loop_p99_us),
            "missed_deadlines": report.map(|r| r.missed_deadlines),
            "lost": self.lost,
            "bag": self.bag,
            "unreadable": self.unreadable,
            "complete": self.bag.as_ref().map(|_| self.complete),
            "loop_gain": summary.map(|s| s.loop_gain),
            "last_loop_gain": summary.map(|s| s.last_loop_gain),
            "peak_contact_force_n": summary.and_then(|s| s.peak_contact_force),
            "peak_feedback_force_n": summary.and_then(|s| s.peak_feedback_force),
            "first_contact_s": summary.and_then(|s| s.first_contact_s),
            "contact_s": summary.map(|s| s.contact_s),
            "outcome": summary.and_then(|s| s.outcome).map(|o| o.word()),
            "outcome_detail": summary.and_then(|s| s.outcome),
            "run": report,
        })
    }
}

/// Share of a node's steps that may miss their deadline before it is worth a word of advice.
const MANY_MISSED: f64 = 1e-3;

/// The loop's times and the deadlines that were missed. In real time the node that missed most is the one to show, with its own numbers: the
/// misses of all nodes beside the times of one that kept its own would hide where the loop is late.
fn timing(report: &RunReport) -> Vec<String> {
    let times = |p50: f64, p99: f64| format!("p50 {p50:.1} us, p99 {p99:.1} us");
    let of = |name: &str| report.nodes.iter().find(|n| n.name == name).and_then(|n| n.status.as_ref());
    let late = report.latest_node.as_ref().and_then(|(name, most)| Some((name, *most, of(name)?)));
    let Some((name, most, status)) = late else {
        let timed = report.loop_node.as_ref().zip(report.loop_p50_us.zip(report.loop_p99_us));
        return timed.map(|(node, (p50, p99))| format!("timing   {node}: {}; 0 missed deadlines", times(p50, p99))).into_iter().collect();
    };
    // Steps that were left out to catch up count as missed too, and stand in the count of steps done.
    let share = most as f64 / status.steps.max(most).max(1) as f64;
    let period = report.rate_hz.map_or(String::new(), |rate| format!(" (a step is {:.0} us)", 1e6 / rate));
    let all = match report.missed_deadlines {
        all if all == most => String::new(),
        all => format!("; {all} in all nodes together"),
    };
    let mut lines = vec![format!(
        "timing   {name} is the slowest node: {}{period}; {most} of its {} steps ({}) missed their deadline{all}",
        times(status.loop_p50_us, status.loop_p99_us),
        status.steps,
        percent(share),
    )];
    if share > MANY_MISSED {
        lines.push(
            "to do    lower --rate, close programs beside the run, or let it run in real time: `backdrive doctor` says what this machine lacks \
             (SCHED_FIFO, timers)"
                .to_string(),
        );
    }
    lines
}

/// Removes what dead runs left.
pub fn clean() -> Result<u8, Failure> {
    let swept = RunHome::system().sweep(Duration::from_secs(60));
    for run in &swept.removed {
        output::line(format_args!("removed {} and {} files in shared memory", run.root.display(), run.shm.len()))?;
    }
    for run in &swept.alive {
        output::line(format_args!("{run} is alive and was left alone"))?;
    }
    for failure in &swept.failed {
        output::note(format_args!("error: {failure}"));
    }
    if swept.removed.is_empty() && swept.failed.is_empty() {
        output::line(format_args!("nothing to remove"))?;
    }
    Ok(if swept.failed.is_empty() { 0 } else { code::MACHINE })
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_launch::NodeReport;
    use backdrive_nodes::protocol::NodeStatus;

    /// A run at 5 kHz of 20 000 steps in which nodes missed so many deadlines.
    fn report(missed: &[(&str, u64)]) -> RunReport {
        let node = |(name, missed): &(&str, u64)| NodeReport {
            name: name.to_string(),
            kind: name.to_string(),
            status: Some(NodeStatus {
                steps: 20_000,
                missed_deadlines: *missed,
                loop_p50_us: 40.0 + *missed as f64,
                loop_p99_us: 400.0 + *missed as f64,
                ..NodeStatus::default()
            }),
            restarts: 0,
            end: "done".to_string(),
        };
        RunReport {
            id: String::new(),
            title: String::new(),
            clock: Clock::Realtime,
            rate_hz: Some(5000.0),
            steps: 20_000,
            planned_steps: Some(20_000),
            startup_s: 0.1,
            duration_s: 4.0,
            steps_per_s: 5000.0,
            loop_node: Some("master".to_string()),
            loop_p50_us: Some(40.0),
            loop_p99_us: Some(400.0),
            missed_deadlines: missed.iter().map(|m| m.1).sum(),
            latest_node: missed.iter().max_by_key(|m| m.1).filter(|m| m.1 > 0).map(|m| (m.0.to_string(), m.1)),
            lost: 0,
            unrecorded: Some(0),
            bag: None,
            recorded: None,
            nodes: missed.iter().map(node).collect(),
            events: Vec::new(),
            events_left_out: 0,
            deaths: Vec::new(),
            killed: Vec::new(),
            cause: Cause::Completed,
            outcome: None,
            peak_contact_force_n: None,
        }
    }

    #[test]
    fn the_slowest_node_is_told_with_its_own_numbers_and_with_advice() {
        let told = timing(&report(&[("master", 55), ("canceller", 5000), ("slave", 2000)]));
        let first = "timing   canceller is the slowest node: p50 5040.0 us, p99 5400.0 us (a step is 200 us); 5000 of its 20000 steps (25.0 %) \
                     missed their deadline; 7055 in all nodes together";
        assert_eq!(told[0], first);
        assert!(told[1].starts_with("to do    lower --rate") && told[1].contains("SCHED_FIFO"), "{told:?}");
        // A few are no reason to do anything, and where one node alone is late its number is the total.
        let few = timing(&report(&[("master", 12), ("slave", 0)]));
        assert!(few.len() == 1 && few[0].contains("12 of its 20000 steps") && !few[0].contains("all nodes"), "{few:?}");
        let none = timing(&report(&[("master", 0), ("slave", 0)]));
        assert_eq!(none, ["timing   master: p50 40.0 us, p99 400.0 us; 0 missed deadlines"]);
    }
}
