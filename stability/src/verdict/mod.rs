//! One verdict from three answers: frequency response, re-simulation, energy; with the reason, and where they disagree.
//!
//! Which answer leads:
//! - Where the models in the bag do what the recording shows, the re-simulation: it knows friction, contact and clamps.
//! - Where they do not, the frequency response, which needs no model; the disagreement is reported, because it is the first sign of effects that the
//!   models omit.
//! - Where neither gives an answer, the verdict is "cannot tell", and the answer states what to record.
//!
//! The method that leads gives the reason; the headline (verdict, stability limit, frequency) is then the least favourable of all that counts: see
//! `headline.rs`. A recording that is cut short, has gaps in it or contains no contact gives no green answer, whatever the methods find.
//!
//! Where both motors' forces were recorded, the recording is judged by what the pair did at its own gains, and their law is identified: `coupled.rs`.
//!
//! Energy never leads: passivity is enough for stability, and not needed for it.

mod coupled;
mod decide;
mod disagreements;
mod headline;
mod loop_check;
mod output;
mod question;
mod recorded;
mod types;
mod warn;
mod warning;
mod witness;
mod word;

pub use coupled::is_coupled;
pub use question::{Question, Swapped};
pub use recorded::{recorded_outcome, recorded_traces};
pub use types::{Answer, AnswerError, Apart, CoupledAxis, Disagreement, LoopCheck, Resimulated};
pub use warning::Warning;
pub use witness::Witness;
pub use word::{Method, Word};

use crate::energy::energy;
use crate::frequency::{self, ExchangedParts};
use crate::model_check::check;
use crate::resimulate::edge::{Search, edge};
use crate::resimulate::grips::grips;
use crate::resimulate::over_cancelling::over_cancelling;
use crate::resimulate::{RunOptions, Scenario};
use crate::session::Session;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use loop_check::loop_check;
use std::sync::atomic::AtomicBool;

/// Hears what is being done, and how much of it is done.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Answers a question.
///
/// # Errors
/// A session without rows, a part that cannot be exchanged or run, or `cancel` was set.
pub fn answer(question: &Question, progress: Progress, cancel: &AtomicBool) -> Result<Answer, AnswerError> {
    let Question { session, recorded, asked, swapped, .. } = question;
    if coupled::is_coupled(session) {
        progress("coupling", 0, 1);
        return Ok(Answer::of_coupled(question));
    }
    progress("frequency response", 0, 1);
    let parts = asked.map(|graph| exchanged(graph, *swapped)).unwrap_or_default();
    let frequency = frequency::analyse(session, &frequency::Options { parts, ..Default::default() })?;
    progress("models against the recording", 0, 1);
    let with_hand = with_recovered_hand(question);
    let mut checks = recorded.map(|graph| check(graph, with_hand.as_ref().unwrap_or(session))).transpose()?.unwrap_or_default();
    checks.extend(session.parts.iter().cloned());
    let mut answer = Answer::of(question, frequency, checks);
    match scenario(question) {
        Ok(scenario) => {
            if !swapped.any() && !answer.runs_away() && answer.frequency.as_ref().is_some_and(|f| f.cannot_tell.is_none()) {
                answer.loop_check = loop_check(&scenario, question, &answer, cancel)?;
            }
            answer.resimulated = Some(resimulate(question, &scenario, progress, cancel)?);
        }
        Err(why) => answer.no_resimulation = Some(why),
    }
    answer.conclude(*swapped);
    Ok(answer)
}

/// The session with a hand that was recovered, where none was recorded: to check models with, not to estimate from.
fn with_recovered_hand(question: &Question) -> Option<Session> {
    let intents = question.intents.as_ref().filter(|i| i.len() == question.session.axes.len())?;
    if question.session.axes.iter().all(|a| a.intent.is_some()) {
        return None;
    }
    let mut session = question.session.clone();
    for (axis, intent) in session.axes.iter_mut().zip(intents) {
        let Intent::Recorded(rows) = intent else { return None };
        axis.intent = Some(rows.iter().map(|row| row[0]).collect());
    }
    Some(session)
}

/// The parts of a graph that are not those that recorded the session.
fn exchanged(graph: &Graph, swapped: Swapped) -> ExchangedParts<'_> {
    let files = |kind: NodeKind| graph.node_of(kind).map(|n| &n.settings);
    let device = |kind: NodeKind| -> Option<&DeviceFiles> {
        match files(kind) {
            Some(Settings::Master(files) | Settings::Slave(files)) => Some(files),
            _ => None,
        }
    };
    ExchangedParts {
        canceller: match files(NodeKind::Canceller) {
            Some(Settings::Canceller(files, corner, hand)) if swapped.canceller => Some((files, *corner, hand.as_ref())),
            _ => None,
        },
        master: device(NodeKind::Master).filter(|_| swapped.master),
        slave: device(NodeKind::Slave).filter(|_| swapped.slave),
    }
}

fn scenario(question: &Question) -> Result<Scenario, String> {
    let Some(graph) = question.asked else { return Err("the bag contains no models".to_string()) };
    if question.intents.is_none() && question.script.is_none() {
        return Err("the hand's motion was not recorded and could not be recovered; name one with --script".to_string());
    }
    let scenario =
        Scenario::new(graph.clone(), question.intents.clone(), Some(question.session.len() as u64)).map_err(|e| e.to_string())?;
    Ok(match &question.script {
        Some(script) => scenario.with_script(script),
        None => scenario,
    })
}

fn resimulate(question: &Question, scenario: &Scenario, progress: Progress, cancel: &AtomicBool) -> Result<Resimulated, AnswerError> {
    progress("the requested gain", 0, 1);
    let keep = RunOptions { keep_signals: true, ..RunOptions::default() };
    let run = scenario.run(question.gain, &keep, cancel)?;
    let signals = run.signals.unwrap_or_else(|| question.session.clone());
    let options = RunOptions::default();
    let edge = edge(scenario, &question.search, &options, &|done, all| progress("the stability limit", done, all), cancel)?;
    let asked = Some(question.gain.product());
    let others: Vec<f64> = question.grips.iter().copied().filter(|s| *s != 1.0).collect();
    // For other grips the stability limit need not be as exact.
    let coarse = Search { tolerance: 0.02, per_decade: 20, whole_grid: false, ..question.search };
    let grips = grips(scenario, &others, asked, &coarse, &options, &|done, all| progress("other grips", done, all), cancel)?;
    let over_cancelling = over_cancelling(scenario, &question.grips, asked, &options, cancel).ok();
    let energy = energy(&signals, Some(scenario.graph()), None);
    Ok(Resimulated { outcome: run.outcome, signals, edge, grips, over_cancelling, energy, script: scenario.script().to_string() })
}
