//! What to do after a run or a replay, with the commands that do it.

use crate::offered::{Builder, Offered, Step, plain, recover};
use backdrive_bags::free;
use backdrive_nodes::graph::Graph;
use backdrive_report::number;
use backdrive_runs::Done;
use backdrive_stability::outcome::Outcome;
use std::path::{Path, PathBuf};

/// By this factor the force scale is lowered for a first look at a loop that is not stable.
const LOWER: f64 = 0.5;

/// What to do, the most useful first. `source` is the bag that was replayed, if one was.
pub fn next(done: &Done, graph: &Graph, source: Option<&Path>) -> Vec<Step> {
    let mut steps = Vec::new();
    // The bags of several hosts are merged before anything can be asked of them.
    let bag = done.bag.as_deref().filter(|_| done.unreadable.is_none() && graph.hosts.is_empty());
    // A replay is asked about in a bag of its own: nothing else holds all of its changes.
    let (first, bag) = match (bag, source) {
        (Some(bag), _) => (Vec::new(), Some(bag.to_path_buf())),
        (None, Some(_)) => {
            let bag = free(&PathBuf::from("replayed.mcap"));
            let replay = Builder::again().without("--html", true).without("--json", false).without("--overwrite", false);
            // Each step begins with it, and a user may take more than one.
            (vec![replay.option_writes("--bag", &bag).flag("--overwrite").build()], Some(bag))
        }
        (None, None) => (Vec::new(), None),
    };
    let ask = |verb: &str, page: &str| -> Vec<Option<Offered>> {
        let Some(bag) = &bag else { return vec![None] };
        let asked = Builder::verb(verb).reads_later(bag).option_writes("--html", Path::new(page)).build();
        first.iter().cloned().chain([asked]).collect()
    };
    let summary = done.summary.as_ref();
    match summary.and_then(|s| s.outcome) {
        Some(Outcome::NotJudged { why }) => steps.push(Step::said(why.advice())),
        Some(Outcome::Stable) if graph.gains.lambda > 0.0 => steps.push(Step::new(
            "Find out how far the stability limit is, and whether the loop stays stable with stiffer and softer grips.",
            ask("stability", "stability.html"),
        )),
        None | Some(Outcome::Stable) => {}
        Some(_) => {
            steps.push(Step::new("Find out why it is not stable, and what would stabilise it.", ask("why", "why.html")));
            let gain = summary.map_or(1.0, |s| s.loop_gain);
            steps.push(Step::new(
                format!("Find the gain up to which this loop is stable (it is not at {}).", number(gain)),
                ask("stability", "stability.html"),
            ));
            let lower = plain(LOWER * graph.gains.lambda);
            let again = match (source, &done.bag) {
                (Some(_), _) => Some(Builder::again().without("--json", false).without("--bag", true)),
                (None, Some(bag)) if done.unreadable.is_none() && graph.hosts.is_empty() => Some(Builder::verb("replay").reads(bag)),
                (None, _) => None,
            };
            let again = again.and_then(|again| again.option("--lambda", lower).option_writes("--html", Path::new("lower.html")).build());
            steps.push(Step::new("Re-simulate it with the recorded hand and half the force scale.", [again]));
        }
    }
    if let Some(bag) = done.bag.as_deref().filter(|_| !done.complete && done.lost == 0) {
        steps.push(Step::new("The bag was cut off: make a clean copy of its content.", [recover(bag)]));
    }
    if done.lost > 0 || done.report.as_ref().is_some_and(|r| r.missed_deadlines > 0) {
        steps.push(Step::new("Find out what delays messages on this machine.", [Builder::verb("doctor").build()]));
    }
    steps
}
