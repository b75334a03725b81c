//! How fast the full nonlinear loop of paper 002 runs in one process, and how fine its steps are.
//!
//!     cargo bench --bench loop
//!
//! Prints simulated seconds per second for several numbers of substeps (medians of 10 runs): by the wall clock, and by the CPU time of this process. On a
//! shared machine the CPU time gives the speed of the loop. Beside each value it prints the largest change of any output when the step is halved. The
//! change is a share of that output's range, up to the end of the sustained push.

use backdrive_msgs::{Message, Sample};
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Sensors, Settings};
use backdrive_nodes::sequence::Sequence;
use nix::time::{ClockId, clock_gettime};
use std::path::Path;
use std::time::{Duration, Instant};

const END_OF_PUSH_S: f64 = 3.0;

fn graph(substeps: usize) -> Graph {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("launch/contact.toml");
    let ideal = Overrides { sensors: Some(Sensors::Ideal), ..Overrides::default() };
    let mut graph = Graph::load(&path, &ideal).expect("the contact graph is part of the workspace");
    for node in &mut graph.nodes {
        if let Settings::Master(files) | Settings::Canceller(files, ..) | Settings::Slave(files) = &mut node.settings {
            files.substeps = Some(substeps);
        }
    }
    graph
}

fn sequence(graph: &Graph) -> Sequence {
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(graph, &n.name).expect("builds")).collect();
    Sequence::new(plans, &graph.timing).expect("has no loop")
}

/// Name and one value per step.
type Column = (String, Vec<f64>);

/// Every measured number of every topic, a column each.
fn outputs(graph: &Graph) -> Vec<Column> {
    let mut sequence = sequence(graph);
    let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
    let mut columns: Vec<Column> =
        names.iter().flat_map(|n| ["position", "velocity", "effort"].map(|q| (format!("{n}.{q}"), Vec::new()))).collect();
    let mut take = |topic: usize, message: &Message| {
        if let Message::Sample(Sample { position, velocity, effort, .. }) = message {
            for (quantity, values) in [position, velocity, effort].into_iter().enumerate() {
                columns[3 * topic + quantity].1.push(values[0]);
            }
        }
    };
    sequence.run((END_OF_PUSH_S * graph.timing.rate_hz) as u64, Some(&mut take));
    columns.retain(|(_, c)| c.iter().any(|x| !x.is_nan()));
    columns
}

/// The output that halving the step moves most, and by what share of its range.
fn moved(coarse: &Graph, fine: &Graph) -> (String, f64) {
    let (coarse, fine) = (outputs(coarse), outputs(fine));
    let share = |((name, a), (_, b)): (&Column, &Column)| {
        let (low, high) = b.iter().filter(|x| !x.is_nan()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        let most = a.iter().zip(b).filter(|(x, _)| !x.is_nan()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        (name.clone(), if high > low { most / (high - low) } else { 0.0 })
    };
    coarse.iter().zip(&fine).map(share).max_by(|a, b| a.1.total_cmp(&b.1)).expect("there are outputs")
}

/// Time that this process has had a core.
fn core_time() -> Duration {
    clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).map(Duration::from).unwrap_or_default()
}

fn main() {
    println!("substeps  times real time: wall    core   halving moves at most");
    for substeps in [1, 2, 4, 8] {
        let graph = graph(substeps);
        let steps = graph.timing.steps.expect("has a duration");
        let (mut wall, mut core): (Vec<f64>, Vec<f64>) = (0..10)
            .map(|_| {
                let mut sequence = sequence(&graph);
                let (start, core) = (Instant::now(), core_time());
                sequence.run(steps, None);
                let simulated = steps as f64 / graph.timing.rate_hz;
                (simulated / start.elapsed().as_secs_f64(), simulated / (core_time() - core).as_secs_f64())
            })
            .unzip();
        let median = |speeds: &mut Vec<f64>| {
            speeds.sort_by(f64::total_cmp);
            (speeds[4] + speeds[5]) / 2.0
        };
        let (name, share) = moved(&graph, &self::graph(2 * substeps));
        let (wall, core) = (median(&mut wall), median(&mut core));
        println!("{substeps:>8}  {wall:>21.0}  {core:>6.0}   {:.4} % of {name}", 100.0 * share);
    }
}
