//! A loop that shakes at this moment: its cause from what has been recorded so far, in a second or two, and the gain at which it would be calm.
//!
//! Where [`crate::answer`] tries every remedy, here only what can be done while a loop runs is looked for: a lower gain. What happens is not judged
//! from the recording, which may end a quarter of a second after it began: whoever watches has found it.

use crate::as_recorded::as_recorded;
use crate::cause::{Asked, Cause, causes, reproduces};
use crate::change::Change;
use crate::differences::{Differences, Look, differences};
use crate::happening::Happening;
use crate::named::named;
use crate::recording::{Recording, RecordingError};
use crate::remedy::{doubts, holds, robust};
use crate::trial::Hand;
use backdrive_control::operator::Intent;
use backdrive_control::scaling::{GainChange, GainPlan};
use backdrive_msgs::Gains;
use backdrive_nodes::graph::{Graph, Settings};
use backdrive_stability::by_itself::alone::AloneError;
use backdrive_stability::by_itself::compared::SMALL;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::{Gain, ResimulateError, RunOptions};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Time before the end of the recording that is re-simulated, s.
const LAST_S: f64 = 1.5;

/// Time in which the re-simulated hand goes from rest to where it was, s.
const LEAD_S: f64 = 0.3;

/// Time for which it then stays where it is at the end, s: a loop is judged while the hand rests.
const REST_S: f64 = 0.8;

/// Shares of the critical gain that are tried as a lower gain, as [`crate::remedy`] does.
const BELOW: [f64; 3] = [0.8, 0.5, 0.25];

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum NowError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It is not the bag of a run of ours.
    #[error("is not the bag of a run, so there is no graph to compare it with")]
    NoGraph,
    /// A node cannot be run by itself.
    #[error(transparent)]
    Alone(#[from] AloneError),
    /// The loop cannot be re-simulated.
    #[error(transparent)]
    Loop(#[from] ResimulateError),
}

/// What was seen of a loop that shakes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Hz.
    pub frequency_hz: f64,
    /// Half the peak-to-peak of the master's position, m or rad.
    pub amplitude: f64,
    /// Position scale in force.
    pub mu: f64,
    /// Force scale in force.
    pub lambda: f64,
}

/// Cause and cure.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Found {
    /// Causes in words with their confidence, 0 to 1, the likeliest first.
    pub causes: Vec<(String, f64)>,
    /// Where the recording differs from the graph, in words.
    pub differs: Vec<String>,
    /// Whether the recorded loop shakes in its re-simulation too.
    pub reproduced: bool,
    /// The critical mu*lambda of the recorded loop; `None` where there is none within a factor of 20.
    pub edge: Option<f64>,
    /// The force scale that is offered; `None` where none below the one in force helps.
    pub lambda: Option<f64>,
    /// Whether the loop is stable at it also with grips of 0.7 to 1.5 times and on walls of 0.5 to 2 times.
    pub robust: bool,
}

/// The end of what the hand did, from rest, and then at rest.
fn hand(intents: &[Intent], rows: usize, rate_hz: f64) -> Hand {
    let steps = |seconds: f64| (seconds * rate_hz).ceil() as usize;
    let (kept, rest) = (steps(LAST_S).min(rows), steps(REST_S));
    // What begins with the run needs no lead.
    let lead = if kept < rows { steps(LEAD_S) } else { 0 };
    let of = |intent: &Intent| {
        let Intent::Recorded(all) = intent else { return intent.clone() };
        let last = &all[all.len().saturating_sub(kept)..];
        let (from, speed) = last.first().map_or((0.0, 0.0), |row| (row[0], 1.0 / LEAD_S));
        let smooth = |i: usize| {
            let s = i as f64 / lead as f64;
            [from * s * s * (3.0 - 2.0 * s), from * 6.0 * s * (1.0 - s) * speed]
        };
        let end = last.last().map_or(0.0, |row| row[0]);
        let rows = (0..lead).map(smooth).chain(last.iter().copied()).chain(std::iter::repeat_n([end, 0.0], rest));
        Intent::Recorded(rows.collect())
    };
    Hand { intents: Some(intents.iter().map(of).collect()), steps: (lead + kept + rest) as u64, rate_hz }
}

/// The graph with the gains that were in force, whoever set them: the graph file, a person or the guard.
fn as_run(graph: &Graph, recorded: &[(String, Gains)]) -> Graph {
    let mut graph = graph.clone();
    let Some(topic) = graph.loop_node().map(|node| format!("/{}/gains", node.name)) else { return graph };
    let mut gains = recorded.iter().filter(|(of, _)| *of == topic).map(|(_, gains)| gains);
    let Some(first) = gains.next() else { return graph };
    let period_s = graph.period_s();
    // Half a step before, so that rounding does not shift it by one.
    let at = |g: &Gains| GainChange { at_s: (g.step as f64 - 0.5) * period_s, mu: g.mu, lambda: g.lambda };
    graph.gains = GainPlan { mu: first.mu, lambda: first.lambda, ramp_s: 0.0, changes: gains.map(at).collect() };
    for node in &mut graph.nodes {
        if let Settings::Scaling { guard, .. } = &mut node.settings {
            *guard = false;
        }
    }
    graph
}

/// Why a loop shakes, from its bag so far. `hear` receives what is being done.
///
/// # Errors
/// The bag cannot be read, or its loop cannot be re-simulated; `cancel` was set.
pub fn why_now(bag: &Path, seen: &Seen, hear: &(dyn Fn(&str) + Sync), cancel: &AtomicBool) -> Result<Found, NowError> {
    let recording = Recording::read(bag, None)?;
    let (session, ours) = (&recording.session, recording.ours.as_ref().ok_or(NowError::NoGraph)?);
    let (graph, recorded) = (&ours.graph, &ours.recorded);
    let unit = backdrive_stability::verdict::recorded_traces(session).first().map_or(backdrive_stability::outcome::Unit::Metre, |t| t.unit);
    let mut happening = Happening::LimitCycle { amplitude_m: seen.amplitude, frequency_hz: seen.frequency_hz, unit };
    let gain = Gain { mu: seen.mu, lambda: seen.lambda };
    let look = Look { small: SMALL, patience: Duration::ZERO };
    let Differences { found, .. } = differences(&as_run(graph, &recorded.gains), recorded, &look, hear, cancel)?;
    let differs = found.iter().map(|d| named(d, graph).2).collect();
    let mut answer = Found { causes: Vec::new(), differs, reproduced: false, edge: None, lambda: None, robust: false };
    let Some(intents) = &ours.intents else { return Ok(answer) };
    let hand = hand(intents, recorded.rows, graph.timing.rate_hz);
    let was = as_recorded(graph, &found);
    hear("the loop as recorded");
    let run = was.run(&hand, gain, &RunOptions::default(), cancel)?;
    answer.reproduced = reproduces(&happening, &run.outcome, run.frequency_hz);
    // A limit of the motors hides what happens beneath: then the causes are looked for without it.
    let (mut loop_of_causes, mut always, mut does) = (was.clone(), Vec::new(), run.outcome);
    if let Outcome::Limited { .. } = run.outcome {
        Change::NoLimits.apply(&mut loop_of_causes);
        always.push(Change::NoLimits);
        let beneath = loop_of_causes.run(&hand, gain, &RunOptions::default(), cancel)?;
        if Happening::of_run(&beneath).is_trouble() {
            (happening, does, answer.reproduced) = (Happening::of_run(&beneath), beneath.outcome, true);
        }
    }
    answer.edge = loop_of_causes.edge(&hand, gain.product(), cancel)?.critical_gain;
    hear("without each suspect");
    let asked = Asked {
        graph,
        was: &loop_of_causes,
        differences: &found,
        hand: &hand,
        gain,
        happening: &happening,
        again: &does,
        always: &always,
        edge: answer.edge,
        reproduced: answer.reproduced,
        shakes_again: answer.reproduced || !does.is_stable(),
    };
    answer.causes = causes(&asked, cancel)?.into_iter().map(|c| (words(&c), c.confidence)).collect();
    hear("at lower gains");
    let unsure = doubts(&found);
    for lambda in answer.edge.iter().flat_map(|edge| BELOW.map(|share| share * edge / seen.mu.abs())).filter(|lambda| *lambda < seen.lambda)
    {
        let lower = Gain { mu: seen.mu, lambda };
        if !holds(&was, &hand, lower, cancel)? {
            continue;
        }
        answer.robust = robust(&was, &hand, lower, (true, &unsure), cancel)?;
        // The highest that holds with other grips and walls; where none does, the lowest that was tried.
        answer.lambda = Some(lambda);
        if answer.robust {
            break;
        }
    }
    Ok(answer)
}

fn words(cause: &Cause) -> String {
    let place = if cause.place.is_empty() { String::new() } else { format!(" ({})", cause.place) };
    format!("{}{place}: {}", cause.kind.words(), cause.evidence)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_comes_from_rest_and_goes_to_rest() {
        let rows: Vec<[f64; 2]> = (0..5000).map(|i| [0.001 * f64::from(i), 1.0]).collect();
        let long = hand(&[Intent::Recorded(rows)], 5000, 1000.0);
        let Some([Intent::Recorded(rows)]) = long.intents.as_deref() else { panic!("recorded") };
        assert_eq!((rows.len(), long.steps), (300 + 1500 + 800, 2600));
        assert_eq!((rows[0], rows[300][0], rows[2599]), ([0.0, 0.0], 3.5, [4.999, 0.0]));
        // The velocity of the lead is the derivative of its position.
        let slope = (rows[151][0] - rows[149][0]) / 0.002;
        assert!((slope - rows[150][1]).abs() < 1e-3 * slope, "{slope} {}", rows[150][1]);
        // A run that has just begun is taken as it is.
        let short = hand(&[Intent::Recorded(vec![[0.5, 0.0]; 100])], 100, 1000.0);
        assert_eq!(short.steps, 900);
    }
}
