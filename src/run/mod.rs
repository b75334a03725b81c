//! `backdrive run` and `backdrive clean`.

mod live;
mod next;
mod text;

pub use next::next;
pub use text::tell;

use crate::cli;
use crate::failure::{Failure, code};
use crate::output;
use crate::progress::Terminal;
use backdrive_launch::RunHome;
use backdrive_launch::asked::Meeting;
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_nodes::stage::Clock;
use backdrive_pages::run::{Heard, page};
use backdrive_runs::Done;
use backdrive_runs::way::{Way, run_graph, run_here};
use backdrive_runs::{experiments, source};
use live::Windowed;
use serde_json::json;
use std::time::Duration;

/// Runs a graph, or each experiment of one.
pub fn run(options: &cli::Run) -> Result<u8, Failure> {
    let changes = options.changes.overrides(options.clock);
    let mut graph = source::load(&options.graph, &changes)?;
    if options.host.is_none() {
        graph = graph.on_one_host();
    }
    let (host, secret) = (options.host.clone(), options.secret.clone());
    let way = Way::of(&graph, options.transport, Meeting { wire: None, host, secret, network: options.network.asked() })?;
    if !graph.experiments.is_empty() {
        return each_experiment(options, &way, &graph, &changes);
    }
    if options.out.is_some() {
        return Err(Failure::input(format!("{}: has no [[experiments]], so --out has no effect; use --bag", options.graph.display())));
    }
    if let Some(html) = &options.result.html {
        output::writable(html)?;
    }
    let mut heard = Heard::of(&graph);
    if options.live.is_some() || options.why || options.heal.is_some() {
        watchable(&way, &graph)?;
    }
    let terminal = Windowed::of(options, graph.gains.lambda);
    let done = match &way {
        // What goes by is all there is where no bag is recorded.
        Way::Here if options.result.html.is_some() => run_here(&graph, &terminal, &mut |topic, message| heard.take(topic, message))?,
        Way::Here | Way::Processes(_) => run_graph(&graph, &way, &terminal)?,
    };
    terminal.end(&ended(&done));
    if let (Way::Processes(_), Some(bag), true) = (&way, &done.bag, options.result.html.is_some()) {
        heard = Heard::from_bag(&graph, bag).map_err(Failure::input)?;
    }
    let steps = next(&done, &graph, None);
    let page = options.result.html.as_deref().map(|html| (html, page(&done, &graph, &heard, &steps)));
    tell(&done, page, options.result.json, &steps)
}

/// Whether a page can show the run; what it will not show well is noted.
fn watchable(way: &Way, graph: &Graph) -> Result<(), Failure> {
    if matches!(way, Way::Here) {
        return Err(Failure::input("--live, --why and --heal are for a run of processes; omit --transport inproc"));
    }
    if graph.timing.clock == Clock::Lockstep {
        output::note(
            "note: in lockstep the run goes as fast as the machine allows; --clock realtime lets it run, and be watched, at its own speed",
        );
    }
    Ok(())
}

/// How a run has ended, for who watched it.
fn ended(done: &Done) -> String {
    let outcome = done.summary.as_ref().and_then(|s| s.outcome).map_or_else(|| "no loop was judged".to_string(), |o| o.to_string());
    let bag = done.bag.as_ref().map_or(String::new(), |bag| format!("; bag {}", bag.display()));
    let cause = done.report.as_ref().map_or(String::new(), |r| format!("{}: ", r.cause));
    format!("{cause}{outcome}{bag}")
}

/// Runs every experiment of a graph and writes one set of recordings, or one for each step of a protocol: a folder with a bag for each experiment,
/// `set.toml` and the model of the device that was recorded.
fn each_experiment(options: &cli::Run, way: &Way, graph: &Graph, changes: &Overrides) -> Result<u8, Failure> {
    if options.result.html.is_some() {
        return Err(Failure::input(format!("{}: has several experiments, and --html is the page of one run", options.graph.display())));
    }
    if options.changes.bag.is_some() {
        return Err(Failure::input(format!("{}: has several experiments; name their folder with --out", options.graph.display())));
    }
    let asked = experiments::Options { file: &options.graph, changes, way, out: options.out.as_deref() };
    let sets = experiments::run(graph, &asked, &Terminal::default())?;
    for set in &sets {
        for (name, text) in set.texts() {
            output::file(&set.folder.join(name), text)?;
        }
    }
    if options.result.json {
        let sets: Vec<_> = sets.iter().map(|s| json!({ "set": s.folder, "fit": s.fit, "held_out": s.held_out })).collect();
        output::line(json!({ "sets": sets }))?;
    } else {
        for set in &sets {
            let (file, fit, held_out) = (set.folder.join("set.toml"), set.fit.len(), set.held_out.len());
            output::line(format_args!("{}: {fit} recordings to fit, {held_out} held out", file.display()))?;
        }
    }
    Ok(0)
}

/// Removes what dead runs left.
pub fn clean() -> Result<u8, Failure> {
    let swept = RunHome::system().sweep(Duration::from_secs(60));
    for run in &swept.removed {
        output::line(format_args!("removed {} and {} files in shared memory", run.root.display(), run.shm.len()))?;
    }
    for run in &swept.alive {
        output::line(format_args!("{run} is running and was not touched"))?;
    }
    for failure in &swept.failed {
        output::note(format_args!("error: {failure}"));
    }
    if swept.removed.is_empty() && swept.failed.is_empty() {
        output::line(format_args!("nothing to remove"))?;
    }
    Ok(if swept.failed.is_empty() { 0 } else { code::MACHINE })
}
