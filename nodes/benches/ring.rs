//! Cost of our transport: a lockstep loop through five processes with a recorder listening to all of it, against bytes going round a ring of five
//! processes through pipes. Also the same with the bag written, with nodes that share processes, and a hop between two processes that poll.
//!
//! `cargo bench -p backdrive-nodes --bench ring [-- LOOPS RUNS]`. The runs are interleaved and medians
//! compared, for on a shared machine only ratios of neighbouring runs mean anything. One loop crosses
//! five process boundaries in both: master, canceller, scaling, slave, scaling, and back to the master.

#[path = "../tests/common/mod.rs"]
mod common;
mod rings;

use backdrive_bags::{BagHeader, Recorder, RecorderOptions, TopicInfo};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::Sample;
use backdrive_nodes::clock::now_ns;
use backdrive_nodes::process::{ProcessOptions, run_processes};
use backdrive_nodes::recorder::{Sink, run_recorder};
use backdrive_nodes::runner::Options;
use backdrive_nodes::sequence::Sequence;
use backdrive_nodes::stage::{Clock, Timing};
use backdrive_nodes::transport::Location;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use common::{NODES, listeners, plans, recorder_plan, timing};
use rings::stopwatch::{Figures, medians};
use rings::supervised::{Counting, Ended, run};
use rings::{Result, children, pipes};
use std::process::ExitCode;

const SIZE: usize = std::mem::size_of::<Sample>();

fn main() -> Result<ExitCode> {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["pipe", size] => pipes::relay(size.parse()?),
        ["node", names, location, steps, bag] => node(names, &serde_json::from_str(location)?, steps.parse()?, bag),
        ["hop", name, location, steps, wait] => hopper(name, &serde_json::from_str(location)?, steps.parse()?, wait == &"poll"),
        numbers => compare(number(numbers.first(), 30_000)?, number(numbers.get(1), 10)?),
    }
}

fn number(text: Option<&&str>, default: u64) -> Result<u64> {
    Ok(text.map_or(Ok(default), |t| t.parse())?)
}

fn compare(loops: u64, runs: u64) -> Result<ExitCode> {
    children::end_with_signals()?;
    println!("{loops} loops per run, medians of {runs} interleaved runs, messages of {SIZE} bytes");
    let folder = tempfile::tempdir()?;
    let bag = folder.path().join("ring.mcap").display().to_string();
    let apart: [&str; 5] = NODES;
    let pairs = ["operator,master", "canceller,scaling", "slave"];
    let one = ["operator,master,canceller,scaling,slave"];
    let mut all: [Vec<Figures>; 7] = Default::default();
    for _ in 0..runs {
        all[0].push(pipes::ring(5, SIZE, loops)?);
        all[1].push(lockstep_ring(loops, &apart, "")?);
        all[2].push(lockstep_ring(loops, &apart, &bag)?);
        all[3].push(lockstep_ring(loops, &pairs, "")?);
        all[4].push(lockstep_ring(loops, &one, "")?);
        all[5].push(hop(loops, "sleep")?);
        all[6].push(hop(loops, "poll")?);
    }
    let [pipes, ours, written, paired, together, sleeping, polling] = &all;
    let pipe = show("pipe ring of 5", pipes);
    let ratios = |name: &str, runs: &[Figures]| {
        let own = show(name, runs);
        println!("    over the pipes': throughput {:.2}, p50 {:.2}, p99 {:.2}", pipe[0] / own[0], own[1] / pipe[1], own[2] / pipe[2]);
    };
    ratios("lockstep of 5 + recorder", ours);
    ratios("with the bag written, lz4", written);
    ratios("in 3 processes + recorder", paired);
    ratios("in 1 process + recorder", together);
    for (name, runs) in [("a hop of two that sleep", sleeping), ("a hop of two that poll", polling)] {
        show(name, &runs.iter().map(|[rate, p50, p99]| [*rate, p50 / 2.0, p99 / 2.0]).collect::<Vec<_>>());
    }
    println!("in one thread: {:.0} ns per loop of the same nodes around empty cores", one_thread()?);
    Ok(ExitCode::SUCCESS)
}

/// Does nothing, so that only what is around it is measured.
struct Empty;

impl Core for Empty {
    fn step(&mut self, _: &Tick, _: &[Port], _: &mut [Sample], _: &mut Events) {}
}

/// ns per step of all five nodes, the best of ten runs.
fn one_thread() -> Result<f64> {
    const STEPS: u64 = 200_000;
    let mut plans = plans(None, true);
    plans.iter_mut().flat_map(|p| &mut p.stages).for_each(|s| s.core = Box::new(Empty));
    let mut sequence = Sequence::new(plans, &ring_timing(STEPS))?;
    let runs = (0..10).map(|_| {
        let begun = now_ns();
        sequence.run(STEPS, None);
        (now_ns() - begun) as f64 / STEPS as f64
    });
    Ok(runs.fold(f64::INFINITY, f64::min))
}

fn show(name: &str, runs: &[Figures]) -> Figures {
    let figures = medians(runs);
    println!("{name:26} {:8.0} loops/s  p50 {:7.2} us  p99 {:7.1} us", figures[0], figures[1], figures[2]);
    figures
}

fn ring_timing(steps: u64) -> Timing {
    timing(Clock::Lockstep, 1000.0, Some(steps))
}

/// The recorder with the bag that it writes, or nodes in one process, their names with commas between them.
fn node(names: &str, location: &Location, steps: u64, bag: &str) -> Result<ExitCode> {
    let transport = Box::new(Iceoryx2::open(location, names)?);
    let timing = ring_timing(steps);
    if names == "recorder" {
        let sink: Box<dyn Sink> = match bag {
            "" => Box::new(Counting::default()),
            bag => {
                Box::new(Recorder::create(bag.as_ref(), &header(), &RecorderOptions { overwrite: true, ..RecorderOptions::lockstep() })?)
            }
        };
        return Ok(run_recorder(&recorder_plan(), &timing, transport, sink));
    }
    let plan_of = |name: &str| plans(None, true).into_iter().find(|p| p.name == name).ok_or("no such node");
    let plans = names.split(',').map(plan_of).collect::<std::result::Result<Vec<_>, _>>()?;
    let options = ProcessOptions { run: Options { listeners: listeners(true), ..Options::default() }, ..ProcessOptions::default() };
    Ok(run_processes(plans, &timing, transport, options))
}

fn header() -> BagHeader {
    let topics = recorder_plan().topics.into_iter();
    let axes = |t: &backdrive_msgs::topic::Topic| match t.kind {
        backdrive_msgs::topic::Kind::Sample => vec!["x".to_string()],
        _ => Vec::new(),
    };
    BagHeader {
        title: "ring".to_string(),
        graph_toml: String::new(),
        files: Default::default(),
        versions: Default::default(),
        seeds: Default::default(),
        clock: backdrive_bags::Clock::Lockstep,
        rate_hz: 1000.0,
        host: String::new(),
        topics: topics.map(|topic| TopicInfo { axes: axes(&topic), topic, publisher: String::new() }).collect(),
        ..BagHeader::default()
    }
}

/// One of two nodes that send a sample to and fro.
fn hopper(name: &str, location: &Location, steps: u64, polls: bool) -> Result<ExitCode> {
    let transport = Box::new(Iceoryx2::open(location, name)?.polling(polls));
    let (heard, delay, spoken) = if name == "ping" { ("/pong/js", 1, "/ping/js") } else { ("/ping/js", 0, "/pong/js") };
    let plan = common::node(name, vec![common::stage(name, Empty, vec![common::input("in", heard, delay)], &[spoken])]);
    let listeners = ["/ping/js", "/pong/js"].map(|topic| (topic.to_string(), 1)).into_iter().collect();
    let options = ProcessOptions { run: Options { listeners, ..Options::default() }, ..ProcessOptions::default() };
    Ok(run_processes(vec![plan], &ring_timing(steps), transport, options))
}

/// There and back.
fn hop(steps: u64, wait: &str) -> Result<Figures> {
    ring_of(steps, "hop", &[("ping".to_string(), wait.to_string()), ("pong".to_string(), wait.to_string())], 0)
}

/// The nodes of these processes and the recorder, which writes a bag where one is named.
fn lockstep_ring(steps: u64, processes: &[&str], bag: &str) -> Result<Figures> {
    let all: Vec<(String, String)> = processes.iter().chain(&["recorder"]).map(|name| (name.to_string(), bag.to_string())).collect();
    let timed = processes.iter().position(|names| names.split(',').any(|n| n == "master")).unwrap_or(0);
    ring_of(steps, "node", &all, timed)
}

/// Processes of this program, (name, how); the figures are those of the one at `timed`.
fn ring_of(steps: u64, what: &str, processes: &[(String, String)], timed: usize) -> Result<Figures> {
    let Ended { seconds, status, .. } = run(steps, what, processes, timed)?;
    Ok([steps as f64 / seconds, status.loop_p50_us, status.loop_p99_us])
}
