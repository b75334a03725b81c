//! `backdrive run` and `backdrive clean`.

mod done;
mod next;
mod source;
mod way;

pub use done::Done;
pub use next::next;
pub use source::runs_from_its_bag;
pub use way::{Way, repeat_here, run_graph, run_here};

use crate::cli;
use crate::failure::{Failure, code};
use crate::output;
use backdrive_launch::RunHome;
use backdrive_pages::run::{Heard, page};
use std::time::Duration;

/// Runs a graph, or each experiment of one.
pub fn run(options: &cli::Run) -> Result<u8, Failure> {
    let changes = options.changes.overrides(options.clock);
    let mut graph = source::load(&options.graph, &changes)?;
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
    if let Some(html) = &options.result.html {
        output::writable(html)?;
    }
    let mut heard = Heard::of(&graph);
    let done = match &way {
        // What goes by is all there is where no bag is recorded.
        Way::Here if options.result.html.is_some() => run_here(&graph, &mut |topic, message| heard.take(topic, message))?,
        Way::Here | Way::Processes(_) => run_graph(&graph, &way)?,
    };
    if let (Way::Processes(_), Some(bag), true) = (&way, &done.bag, options.result.html.is_some()) {
        heard = Heard::from_bag(&graph, bag).map_err(Failure::input)?;
    }
    let steps = next(&done, &graph, None);
    let page = options.result.html.as_deref().map(|html| (html, page(&done.shown(), &graph, &heard, &steps)));
    done.tell(page, options.result.json, &steps)
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
