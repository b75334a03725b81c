//! Loops per second of a ring of processes, over the number of processes and over the size of the message: our lockstep loop with its
//! recorder, iceoryx2 alone, and pipes.
//!
//!     cargo bench -p backdrive-nodes --bench ring_plot -- docs/ring.svg [LOOPS ROUNDS]      (from the root; without a file nothing is drawn)
//!
//! Every kind of ring passes one message round, and its first member looks at the same clock once per loop. A tenth as many loops as count go before
//! them. The kinds take turns, and medians over the rounds are reported. A sample of ours has one size, so that over sizes it is a point.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "rings/picture.rs"]
mod picture;
mod rings;

use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::Sample;
use backdrive_nodes::process::{ProcessOptions, run_processes};
use backdrive_nodes::recorder::{RecorderPlan, run_recorder};
use backdrive_nodes::runner::Options;
use backdrive_nodes::stage::{Clock, InputPort, NodePlan, PACE_PORT};
use backdrive_nodes::transport::Location;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use common::{CREDIT, input, node, recorder_plan, stage, timing, topic};
use picture::{Curve, Panel};
use rings::stopwatch::{Figures, Stopwatch, medians, warm_up};
use rings::supervised::{Counting, run};
use rings::{Result, children, iceoryx2_ring, pipes};
use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::OnceLock;

/// Bytes of a sample of ours.
const SAMPLE: usize = std::mem::size_of::<Sample>();
const NODES: [usize; 7] = [2, 3, 4, 5, 8, 12, 16];
const SIZES: [usize; 6] = [56, SAMPLE, 1024, 4096, 16384, 65536];
/// Nodes of the rings over sizes.
const OF_SIZES: usize = 5;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Apart,
    Together,
    Iceoryx2,
    Pipes,
}

const KINDS: [Kind; 4] = [Kind::Apart, Kind::Together, Kind::Iceoryx2, Kind::Pipes];

impl Kind {
    fn name(self) -> String {
        match self {
            Kind::Apart => "backdrive, a process each".to_string(),
            Kind::Together => "backdrive, together in one".to_string(),
            Kind::Iceoryx2 => format!("iceoryx2 {}, a process each", iceoryx2_version()),
            Kind::Pipes => "pipes, a process each".to_string(),
        }
    }

    fn measure(self, nodes: usize, size: usize, loops: u64) -> Result<Figures> {
        match self {
            Kind::Apart => ours(nodes, 1, loops),
            Kind::Together => ours(nodes, nodes, loops),
            Kind::Iceoryx2 => iceoryx2_ring::ring(nodes, size, loops),
            Kind::Pipes => pipes::ring(nodes, size, loops),
        }
    }
}

/// The version that this program is built with.
fn iceoryx2_version() -> &'static str {
    let mut lines = include_str!("../../Cargo.lock").lines().skip_while(|l| *l != "name = \"iceoryx2\"");
    lines.nth(1).and_then(|l| l.split('"').nth(1)).unwrap_or("")
}

/// A ring that is measured.
struct Point {
    kind: Kind,
    nodes: usize,
    size: usize,
    runs: Vec<Figures>,
}

fn main() -> Result<ExitCode> {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["pipe", size] => pipes::relay(size.parse()?),
        [iceoryx2_ring::MEMBER, index, members, size, location, loops] => {
            iceoryx2_ring::member(index.parse()?, members.parse()?, size.parse()?, &serde_json::from_str(location)?, loops.parse()?)
        }
        ["member", name, location, steps, how] => member(name, &serde_json::from_str(location)?, steps.parse()?, how),
        given => {
            let (files, numbers): (Vec<&str>, Vec<&str>) = given.iter().partition(|a| a.ends_with(".svg"));
            let number = |i: usize, default: u64| numbers.get(i).map_or(Ok(default), |t| t.parse());
            compare(number(0, 3000)?.max(1), number(1, 5)?.max(1), files.first().copied())
        }
    }
}

fn compare(loops: u64, rounds: u64, file: Option<&str>) -> Result<ExitCode> {
    children::end_with_signals()?;
    println!("{loops} loops per ring, medians of {rounds} rounds; a sample of ours has {SAMPLE} bytes");
    let mut points = Vec::new();
    let mut point = |kind, nodes, size| points.push(Point { kind, nodes, size, runs: Vec::new() });
    for nodes in NODES {
        KINDS.into_iter().for_each(|kind| point(kind, nodes, SAMPLE));
    }
    for size in SIZES.into_iter().filter(|size| *size != SAMPLE) {
        [Kind::Iceoryx2, Kind::Pipes].into_iter().for_each(|kind| point(kind, OF_SIZES, size));
    }
    for _ in 0..rounds {
        for point in &mut points {
            let figures = point.kind.measure(point.nodes, point.size, loops);
            if children::interrupted() {
                return Ok(ExitCode::from(130));
            }
            point.runs.push(figures.map_err(|e| format!("{}, {} nodes, {} bytes: {e}", point.kind.name(), point.nodes, point.size))?);
        }
    }
    let of = |kind: Kind, chosen: &dyn Fn(&Point) -> Option<usize>| {
        let mut found: Vec<(usize, Figures)> =
            points.iter().filter(|p| p.kind == kind).filter_map(|p| Some((chosen(p)?, medians(&p.runs)))).collect();
        found.sort_by_key(|(x, _)| *x);
        found
    };
    let over_nodes = KINDS.map(|kind| of(kind, &|p| (p.size == SAMPLE).then_some(p.nodes)));
    let over_sizes = KINDS.map(|kind| of(kind, &|p| (p.nodes == OF_SIZES).then_some(p.size)));
    table(&format!("nodes, messages of {SAMPLE} bytes"), &NODES, &over_nodes);
    table(&format!("bytes, {OF_SIZES} nodes"), &SIZES, &over_sizes);
    if let Some(file) = file {
        let panels = [
            Panel { title: format!("messages of {SAMPLE} bytes"), below: "nodes in the ring", ticks: &NODES, curves: curves(over_nodes) },
            Panel { title: format!("{OF_SIZES} nodes"), below: "bytes in a message", ticks: &SIZES, curves: curves(over_sizes) },
        ];
        // Cargo runs a bench in the folder of its package.
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
        std::fs::write(&path, picture::drawn(&panels)).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn curves(kinds: [Vec<(usize, Figures)>; 4]) -> Vec<Curve> {
    let points = |figures: Vec<(usize, Figures)>| figures.into_iter().map(|(x, [rate, ..])| (x as f64, rate)).collect();
    KINDS.into_iter().zip(kinds).map(|(kind, figures)| Curve { name: kind.name(), points: points(figures) }).collect()
}

/// Loops per second and p50 of each kind.
fn table(over: &str, columns: &[usize], kinds: &[Vec<(usize, Figures)>; 4]) {
    for (what, index, digits) in [("loops/s", 0, 0), ("p50 us", 1, 1)] {
        println!("\n{:32}{}", format!("{what} over {over}"), columns.iter().map(|c| format!("{c:>9}")).collect::<String>());
        for (kind, figures) in KINDS.into_iter().zip(kinds) {
            let cell = |x: &usize| {
                let figure = figures.iter().find(|(at, _)| at == x).map(|(_, figures)| figures[index]);
                figure.map_or(" ".repeat(9), |f| format!("{f:>9.digits$}"))
            };
            println!("{:32}{}", kind.name(), columns.iter().map(cell).collect::<String>());
        }
    }
}

/// The measurements of the first member of our ring, reported after its loop's end.
static MEASURED: OnceLock<Figures> = OnceLock::new();

/// Passes on what it is given.
struct Member {
    watch: Option<Stopwatch>,
}

impl Core for Member {
    fn step(&mut self, _: &Tick, inputs: &[Port], outputs: &mut [Sample], _: &mut Events) {
        if let Some(watch) = &mut self.watch {
            watch.look();
        }
        if let (Some(heard), Some(said)) = (inputs.last().and_then(|p| p.sample), outputs.first_mut()) {
            said.position = heard.position;
            said.velocity = heard.velocity;
            said.effort = heard.effort;
        }
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        if let Some(watch) = &self.watch {
            let _ = MEASURED.set(watch.figures());
        }
    }
}

fn spoken(index: usize) -> String {
    format!("/n{index}/js")
}

/// The member at `index` of a ring. The first one hears the last one a step late, and is not more than 1024 steps ahead of the recorder.
fn plan(index: usize, nodes: usize, watch: Option<Stopwatch>) -> NodePlan {
    let name = format!("n{index}");
    let heard = input("in", &spoken((index + nodes - 1) % nodes), u64::from(index == 0));
    let pace = (index == 0).then(|| InputPort { name: PACE_PORT.into(), topic: topic(CREDIT), delay: 1024, impairment: None });
    node(&name, vec![stage(&name, Member { watch }, pace.into_iter().chain([heard]).collect(), &[&spoken(index)])])
}

fn recorded(nodes: usize) -> RecorderPlan {
    let plans = (0..nodes).map(|i| plan(i, nodes, None));
    let topics = plans.flat_map(|p| [topic(&spoken_by(&p)), p.events, p.status]).collect();
    RecorderPlan { topics, ..recorder_plan() }
}

fn spoken_by(plan: &NodePlan) -> String {
    plan.stages.iter().flat_map(|s| &s.outputs).map(|o| o.topic.name.clone()).next().unwrap_or_default()
}

/// A process of our ring: the recorder, or the members whose numbers `name` lists with commas between them; `nodes` is how many the ring has.
fn member(name: &str, location: &Location, steps: u64, nodes: &str) -> Result<ExitCode> {
    let nodes = nodes.parse()?;
    let transport = Box::new(Iceoryx2::open(location, name)?);
    let timing = timing(Clock::Lockstep, 1000.0, Some(steps));
    let recorder = recorded(nodes);
    if name == "recorder" {
        return Ok(run_recorder(&recorder, &timing, transport, Box::new(Counting::default())));
    }
    // The recorder, and whoever is next in the ring.
    let mut listeners: BTreeMap<String, usize> = recorder.topics.iter().map(|t| (t.name.clone(), 1)).collect();
    (0..nodes).for_each(|i| *listeners.entry(spoken(i)).or_default() += 1);
    let indices = name.split(',').map(str::parse).collect::<std::result::Result<Vec<usize>, _>>()?;
    let watch = |i: usize| (i == 0).then(|| Stopwatch::new(counted(steps)));
    let plans = indices.into_iter().map(|i| plan(i, nodes, watch(i))).collect();
    let options = ProcessOptions { run: Options { listeners, ..Options::default() }, ..ProcessOptions::default() };
    let code = run_processes(plans, &timing, transport, options);
    if let Some(figures) = MEASURED.get() {
        println!("{}", serde_json::to_string(figures)?);
    }
    Ok(code)
}

/// Steps for this number of loops that count: as many clock readings as there are steps.
fn steps(loops: u64) -> u64 {
    warm_up(loops) + loops + 1
}

/// The inverse.
fn counted(of: u64) -> u64 {
    (1..of).rev().find(|loops| steps(*loops) <= of).unwrap_or(1)
}

/// Our ring, `each` nodes to a process, with the recorder.
fn ours(nodes: usize, each: usize, loops: u64) -> Result<Figures> {
    let indices: Vec<String> = (0..nodes).map(|i| i.to_string()).collect();
    let groups = indices.chunks(each).map(|group| group.join(","));
    let processes: Vec<(String, String)> = groups.chain(["recorder".to_string()]).map(|name| (name, nodes.to_string())).collect();
    let last = run(steps(loops), "member", &processes, 0)?.last;
    Ok(serde_json::from_str(&last)?)
}
