//! How much delay and loss a loop over the network bears: the largest stable mu*lambda of the live graph on two hosts,
//! beside what is predicted from a recording over a clean link.
//!
//!     cargo build && cargo run --example network_table            the whole table: 0 to 20 ms, 0 to 5 %
//!     cargo build && cargo run --example network_table -- --short  0, 10 and 20 ms, 0 and 5 %
//!
//! Needs root: it makes two network namespaces, joined by a relay that delays and loses. Every live run is the graph of
//! `launch/contact-hosts.toml` in real time, judged by its own bag. The prediction takes graph and hand from the bag of the
//! clean run and imposes delay and loss on the two connections that cross the network.
//!
//! The hand pushes harder than in the launch file. Because of dry friction this loop can either rest or oscillate at the same gain, depending on its start.
//! On one host without a canceller, the launch file's impact starts the oscillation from 1.15 on. An impact at half its speed does not start it below 1.8,
//! and all impacts at twice its speed and more start it from 0.85 on. With the harder push the loop decides, not the effect of a late sample on the impact.

#[path = "../tests/netns/mod.rs"]
mod netns;

use backdrive_bags::Reader;
use backdrive_nodes::graph::{Files, Graph, Overrides};
use backdrive_nodes::stage::{Clock, Impairment};
use backdrive_stability::resimulate::edge::{Search, edge};
use backdrive_stability::resimulate::{RunOptions, Scenario};
use netns::{Hosts, Link};
use serde_json::Value;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::atomic::AtomicBool;

/// Range of gains in which the critical gain is searched, and the resolution: a factor.
const LOWEST: f64 = 0.1;
const HIGHEST: f64 = 12.8;
const FINE: f64 = 1.3;

const LENGTH: [&str; 2] = ["--duration", "3"];

fn main() -> Result<(), Box<dyn Error>> {
    let short = std::env::args().any(|a| a == "--short");
    let (delays, losses): (&[f64], &[f64]) =
        if short { (&[0.0, 0.01, 0.02], &[0.0, 0.05]) } else { (&[0.0, 0.002, 0.005, 0.01, 0.02], &[0.0, 0.01, 0.05]) };
    let Some(hosts) = Hosts::relayed(Link::default()) else { return Ok(()) };
    let folder = tempfile::tempdir()?;
    let task = Task { program: program()?, graph: pushed(folder.path())?, folder: folder.path() };
    let clean = folder.path().join("clean.mcap");
    let found = run(&hosts, &task, &clean, &["--lambda", "0.3"])?;
    println!("clean link at mu*lambda = 0.3: {}, {} lost", found["outcome"], found["lost"]);
    let clean = clean.with_file_name("clean-desk.mcap");
    println!("{:>9} {:>6}  {:>22}  {:>22}", "", "", "as modelled", "no canceller");
    println!("{:>9} {:>6}  {:>10} {:>11}  {:>10} {:>11}", "delay ms", "loss %", "live", "predicted", "live", "predicted");
    for &delay_s in delays {
        for &loss in losses {
            hosts.relay().set(Link { delay_s, loss, ..Link::default() });
            let mut line = format!("{:>9} {:>6}", delay_s * 1e3, loss * 100.0);
            for canceller in [&[][..], &["--canceller", "none"]] {
                let live = live_edge(&hosts, &task, canceller)?;
                let predicted = predicted_edge(&clean, delay_s, loss, !canceller.is_empty())?;
                line += &format!("  {live:>10} {predicted:>11}");
            }
            println!("{line}");
        }
    }
    Ok(())
}

/// The program that was built with this example.
fn program() -> Result<PathBuf, Box<dyn Error>> {
    let here = std::env::current_exe()?;
    let program = here.parent().and_then(Path::parent).map(|p| p.join("backdrive")).unwrap_or_default();
    if program.exists() { Ok(program) } else { Err(format!("{}: build it first with `cargo build`", program.display()).into()) }
}

/// What is run.
struct Task<'a> {
    program: PathBuf,
    graph: PathBuf,
    folder: &'a Path,
}

/// The launch file with the harder push, in a folder.
fn pushed(folder: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("launch/contact-hosts.toml"))?;
    let harder = text.replace("x = 0.007", "x = 0.012").replace("\"../plant", &format!("\"{}/plant", root.display()));
    if harder.matches("x = 0.012").count() != 2 {
        return Err("launch/contact-hosts.toml: pushes to 7 mm no more".into());
    }
    let path = folder.join("graph.toml");
    std::fs::write(&path, harder)?;
    Ok(path)
}

/// Runs the graph on both hosts; returns the result of the desk host.
fn run(hosts: &Hosts, task: &Task, bag: &Path, more: &[&str]) -> Result<Value, Box<dyn Error>> {
    let start = |host: usize| {
        let mut command = hosts.on(host, &task.program);
        command.arg("run").arg(&task.graph).args(["--host", ["desk", "robot"][host], "--json", "--bag"]).arg(bag).args(LENGTH).args(more);
        command.args(["--sensors", "ideal", "--limits", "ignored"]);
        command.env("TMPDIR", bag.parent().unwrap_or(bag)).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()
    };
    let (desk, robot) = (start(0)?, start(1)?);
    let (desk, _) = (desk.wait_with_output()?, robot.wait_with_output()?);
    Ok(serde_json::from_slice(&desk.stdout).unwrap_or_default())
}

/// The largest gain of a ladder at which the live loop is stable, and the smallest at which it is not.
fn live_edge(hosts: &Hosts, task: &Task, canceller: &[&str]) -> Result<String, Box<dyn Error>> {
    let stable = |gain: f64| -> Result<bool, Box<dyn Error>> {
        let lambda = format!("{gain}");
        let options: Vec<&str> = ["--lambda", &lambda].into_iter().chain(canceller.iter().copied()).collect();
        // A busy machine makes a stable loop look unstable, when a node comes too late, and not the other way round: unstable is what is so twice.
        for _ in 0..2 {
            let found = run(hosts, task, &task.folder.join("live.mcap"), &options)?;
            match found["outcome"].as_str() {
                Some("stable") => return Ok(true),
                Some(_) => {}
                None => eprintln!("mu*lambda {gain}: not judged: {found}"),
            }
        }
        Ok(false)
    };
    if !stable(LOWEST)? {
        return Ok(format!("< {LOWEST}"));
    }
    if stable(HIGHEST)? {
        return Ok(format!("> {HIGHEST}"));
    }
    let (mut low, mut high) = (LOWEST, HIGHEST);
    while high > FINE * low {
        let middle = (low * high).sqrt();
        if stable(middle)? { low = middle } else { high = middle }
    }
    Ok(format!("{low:.2}..{high:.2}"))
}

/// The critical gain of the recorded graph with this delay and loss on what crosses the network.
fn predicted_edge(bag: &Path, delay_s: f64, loss: f64, without: bool) -> Result<String, Box<dyn Error>> {
    let reader = Reader::open(bag)?;
    let header = reader.header().ok_or("the bag has no header")?;
    let files: Vec<(String, String)> = header.files.clone();
    let mut graph = Graph::from_text(&header.graph_toml, bag, &Overrides::default(), &Files::Bag(&files))?.on_one_host();
    graph.timing.clock = Clock::Lockstep;
    let name = |index: usize| graph.nodes[index].name.clone();
    let crossing: Vec<bool> = graph.connections.iter().map(|c| name(c.from.0) == "slave" || name(c.to.0) == "slave").collect();
    for (connection, crosses) in graph.connections.iter_mut().zip(crossing) {
        if crosses {
            connection.impairment = Some(Impairment { delay_s, jitter_s: 0.0, loss, seed: 1 });
        }
    }
    let steps = graph.timing.steps;
    let mut scenario = Scenario::new(graph, None, steps)?;
    if without {
        scenario = scenario.without_canceller();
    }
    let search =
        Search { lowest: LOWEST, floor: LOWEST, highest: HIGHEST, tolerance: 0.02, per_decade: 20, whole_grid: false, around: false };
    let found = edge(&scenario, &search, &RunOptions::default(), &|_, _| {}, &AtomicBool::new(false))?;
    Ok(found.critical_gain.map_or_else(|| format!("> {:.1}", found.at_least), |gain| format!("{gain:.2}")))
}
