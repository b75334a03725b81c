//! What to do after an answer about stability, with the commands that do it.

use crate::cli::words_of;
use crate::offered::{Builder, Offered, Step, plain};
use backdrive_bags::free;
use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_report::{number, percent};
use backdrive_runs::source::runs_from_its_bag;
use backdrive_stability::asked::Options;
use backdrive_stability::verdict::{Answer, Word};
use std::path::Path;

/// A gain is worked at this factor (6 dB) below its stability limit.
const SAFE: f64 = 2.0;

/// What to do, the most useful first. `asked` is the graph that was asked about, of a bag of ours.
pub fn next(found: &Answer, options: &Options, asked: Option<&Graph>) -> Vec<Step> {
    let gain = found.gain.product();
    let lower = |limit: f64| found.critical_gain_ci95.map_or(limit, |ci| ci.0.min(limit)) / SAFE;
    let mut steps = Vec::new();
    match (found.verdict, found.critical_gain, found.at_least) {
        (Word::Stable, Some(limit), _) => {
            let db = 20.0 * (limit / gain).log10();
            let advice = match lower(limit) < gain {
                true => "That is little: a stiffer grip or an older cable may use it up.",
                false => "The gain may rise.",
            };
            steps.push(Step::said(format!(
                "The stability limit is {} dB away. {advice} (6 dB below it, the usual reserve: mu*lambda = {}.)",
                number(db),
                number(lower(limit))
            )));
            let text = "Compute the motion up to the stability limit and above it, before a hand feels it.";
            steps.push(Step::new(text, [at(found, options, asked, limit, "at-the-limit.html")]));
        }
        (Word::Stable, None, Some(least)) => {
            steps.push(Step::said(format!("No stability limit was found up to mu*lambda = {}, the highest gain searched.", number(least))))
        }
        (Word::LimitCycle | Word::Unstable | Word::Limited, limit, least) if limit.or(least).is_some_and(|limit| limit > 0.0) => {
            let safe = lower(limit.or(least).unwrap_or(gain)).min(gain);
            steps.push(Step::new(
                format!(
                    "Lower the force scale: at mu*lambda = {} the loop keeps 6 dB to where it stops being stable, with a reflected force of {} \
                     of the present one.",
                    number(safe),
                    percent(safe / gain)
                ),
                [at(found, options, asked, safe, "lower.html")],
            ));
            steps.extend(cancelled(options, asked));
        }
        _ => {}
    }
    if let Some(advice) = &found.advice {
        let text = format!("To record for a better answer: {}.", advice.trim_end_matches('.'));
        steps.push(Step::new(text, dithered(options, asked, advice)));
    }
    if found.checks.iter().any(|c| !c.agrees) {
        steps.push(Step::new("A model differs from its device: find out which effect it lacks, and ask again.", [why(options)]));
    }
    steps
}

/// The same loop at another gain: a replay where the bag has a graph and its own hand, else the same question.
fn at(found: &Answer, options: &Options, asked: Option<&Graph>, gain: f64, page: &str) -> Option<Offered> {
    let lambda = plain(gain / found.gain.mu);
    if asked.is_some() && options.script.is_none() && options.roles.is_none() {
        let replay = Builder::verb("replay").reads(&options.recording).words(words_of(&options.changes));
        let replay = options.changes.coupling.iter().fold(replay, |replay, law| replay.option("--coupling", law.name()));
        let replay = options.mu.iter().fold(replay, |replay, mu| replay.option("--mu", mu));
        return replay.option("--lambda", lambda).option_writes("--html", Path::new(page)).build();
    }
    let again = asked_again(page);
    let again = match options.mu {
        Some(mu) => again.option("--mu", mu).option("--lambda", lambda),
        None => again.option("--gain", plain(gain)),
    };
    again.build()
}

/// The same question, to be changed.
fn asked_again(page: &str) -> Builder {
    let again = ["--gain", "--mu", "--lambda", "--sweep"].iter().fold(Builder::again(), |again, name| again.without(name, true));
    again.without("--json", false).option_writes("--html", Path::new(page))
}

/// A canceller with the master's model where there is none, a better model where there is one.
fn cancelled(options: &Options, asked: Option<&Graph>) -> Option<Step> {
    let graph = asked?;
    let Settings::Canceller(files, ..) = &graph.node_of(NodeKind::Canceller)?.settings else { return None };
    if files.model.is_some() {
        let text = "Or use a better model of the master in the canceller: this command finds what the present one lacks.";
        return Some(Step::new(text, [why(options)]));
    }
    let again = Builder::again().without("--sweep", true).without("--json", false).option_writes("--html", Path::new("cancelled.html"));
    let text = "Or subtract the induced motion of the master with a canceller. With the model and the grip of the graph's master:";
    Some(Step::new(text, [again.option("--canceller", "master").option("--high-pass", 1).build()]))
}

/// A bag of the same loop with a dither, and the question of it.
fn dithered(options: &Options, asked: Option<&Graph>, advice: &str) -> Vec<Option<Offered>> {
    let excitation = advice.split_once("--dither ").and_then(|(_, rest)| rest.split_whitespace().next()).map(|w| w.trim_end_matches(','));
    let Some(excitation) = excitation else { return Vec::new() };
    if options.roles.is_some() || !asked.is_some_and(runs_from_its_bag) {
        return Vec::new();
    }
    let bag = free(Path::new("dithered.mcap"));
    let run =
        Builder::verb("run").reads(&options.recording).option("--dither", excitation).option_writes("--bag", &bag).flag("--overwrite");
    vec![run.build(), Builder::verb("stability").reads_later(&bag).build()]
}

fn why(options: &Options) -> Option<Offered> {
    let why = Builder::verb("why").reads(&options.recording);
    let why = options.roles.iter().fold(why, |why, roles| why.option_reads("--roles", roles));
    why.option_writes("--html", Path::new("why.html")).build()
}
