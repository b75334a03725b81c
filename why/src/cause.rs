//! What makes a loop shake: causes with their evidence, and how sure each is.
//!
//! Two kinds of evidence count. A *difference* is where the recording differs from the graph: it was seen. An *aspect* of the graph itself (a delay
//! that it states, a grip that its canceller takes for another) was not seen to be wrong, but without it the loop would hold. For both the test is
//! the same: a re-simulation of the recorded loop, and one more without that one thing.

use crate::as_recorded::{as_recorded, is_modelled};
use crate::cause_kind::CauseKind;
use crate::change::Change;
use crate::difference::Difference;
use crate::fine::is_fine;
use crate::happening::Happening;
use crate::named::{named, of_number};
use crate::stated::{Suspect, of_the_graph};
use crate::trial::{Hand, Trial};
use crate::tuned::Tuned;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::{Gain, ResimulateError, RunOptions};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// A cause.
#[derive(Debug, Clone, Serialize)]
pub struct Cause {
    /// Which.
    pub kind: CauseKind,
    /// Where: a node, a port, or a part of the device; may be empty.
    pub place: String,
    /// What was seen, in a sentence.
    pub evidence: String,
    /// What the loop does without it.
    pub without: String,
    /// Whether it holds without it.
    pub holds_without: bool,
    /// The critical mu*lambda without it; `None` where there is none up to twenty times the gain.
    pub edge_without: Option<f64>,
    /// Share of the shaking that goes when this alone is repaired, 0 to 1; `None` where it was not re-simulated.
    pub share: Option<f64>,
    /// Whether it was seen in the recording, and is not only what the graph states.
    pub seen: bool,
    /// 0 to 1.
    pub confidence: f64,
    /// What would put it right.
    #[serde(skip)]
    pub repairs: Vec<Change>,
}

/// What a loop is asked for.
pub struct Asked<'a> {
    /// The graph in the bag.
    pub graph: &'a Graph,
    /// The recorded loop.
    pub was: &'a Trial,
    /// What differs.
    pub differences: &'a [Difference],
    /// The hand.
    pub hand: &'a Hand,
    /// The gain of the recording.
    pub gain: Gain,
    /// What happened.
    pub happening: &'a Happening,
    /// The critical mu*lambda of the recorded loop; `None` where none was found.
    pub edge: Option<f64>,
    /// Whether the re-simulated loop does what was recorded.
    pub reproduced: bool,
    /// Whether the recorded loop oscillates at all in its re-simulation. Where it does not, nothing can be learned from leaving a thing out of it.
    pub shakes_again: bool,
    /// What the loop that causes are looked for in does.
    pub again: &'a Outcome,
    /// Changes that every run has besides: motors without limits, where a limit hides what happens beneath.
    pub always: &'a [Change],
}

/// A difference that was seen weighs this many times as much as an aspect of the graph.
const SEEN: f64 = 6.0;

/// The increase of the stability limit without a thing counts up to this factor.
const FURTHER: f64 = 4.0;

/// Weight of a thing without which the loop does as before.
const NO_EVIDENCE: f64 = 0.05;

/// A thing whose removal removes this share of the amplitude explains the oscillation, even if the rest of it goes on.
const MOST_OF_IT: f64 = 0.5;

/// Weight of the gain where something else explains the shaking.
const GAIN_BESIDE: f64 = 0.4;

/// Every cause, the likeliest first.
///
/// # Errors
/// A loop that cannot be run; `cancel` was set.
pub fn causes(asked: &Asked, cancel: &AtomicBool) -> Result<Vec<Cause>, ResimulateError> {
    let suspects = suspects(asked);
    let gain = asked.gain.product();
    // Several things may shake a loop each by itself: then it goes on without any one of them, and holds without all.
    let seen = suspects.iter().filter(|s| s.seen).count();
    let holds_without_all = seen > 1 && {
        let mut none = Trial::of(asked.graph.clone());
        asked.always.iter().for_each(|c| c.apply(&mut none));
        let run = none.run(asked.hand, asked.gain, &RunOptions::default(), cancel)?;
        is_fine(&none, asked.hand, asked.gain, &run, cancel)?
    };
    let judged: Vec<(Cause, f64)> = suspects
        .into_par_iter()
        .map(|mut suspect| {
            asked.always.iter().for_each(|c| c.apply(&mut suspect.without));
            let run = suspect.without.run(asked.hand, asked.gain, &RunOptions::default(), cancel)?;
            let edge = if run.outcome.is_stable() { suspect.without.edge(asked.hand, gain, cancel)?.critical_gain } else { None };
            let holds = run.outcome.is_stable();
            let further = match holds {
                // A loop that is stable with and without a thing gives no evidence on it.
                _ if !asked.shakes_again => NO_EVIDENCE,
                true => edge.map_or(FURTHER, |e| (e / gain).clamp(1.0, FURTHER)),
                false => taken_along(asked.happening, &run.outcome).filter(|share| *share >= MOST_OF_IT).unwrap_or(NO_EVIDENCE),
            };
            let share = share_of(asked, &run.outcome);
            let further = if suspect.seen && holds_without_all { further.max(MOST_OF_IT + 0.5 * share) } else { further };
            let weight = further * if suspect.seen { SEEN } else { 1.0 };
            let cause = Cause {
                kind: suspect.kind,
                place: suspect.place,
                evidence: suspect.evidence,
                without: run.outcome.to_string(),
                holds_without: holds,
                edge_without: edge,
                share: asked.shakes_again.then_some(share),
                seen: suspect.seen,
                confidence: 0.0,
                repairs: suspect.repairs,
            };
            Ok((cause, weight))
        })
        .collect::<Result<_, ResimulateError>>()?;
    Ok(weighed(asked, judged.into_iter().chain(unknown(asked)).collect()))
}

/// Share of the shaking that goes without a thing: all of it where the loop then holds, else by what is left of the amplitude or of the growth.
fn share_of(asked: &Asked, without: &Outcome) -> f64 {
    let left = match (asked.again, without) {
        (_, without) if without.is_stable() => 0.0,
        (Outcome::LimitCycle { amplitude_m: was, .. }, Outcome::LimitCycle { amplitude_m: left, .. }) => left / was,
        (Outcome::Unstable { growth_per_s: was }, Outcome::Unstable { growth_per_s: left }) => left / was,
        // What no longer grows beyond all bounds is less by an amount that has no number.
        (Outcome::Unstable { .. }, Outcome::LimitCycle { .. }) => 0.5,
        (Outcome::Limited { clamped_share: was, .. }, Outcome::Limited { clamped_share: left, .. }) => left / was,
        _ => 1.0,
    };
    (1.0 - left).clamp(0.0, 1.0)
}

/// Share of the amplitude that a thing causes; `None` where the one or the other is no limit cycle.
fn taken_along(happening: &Happening, without: &Outcome) -> Option<f64> {
    match (happening, without) {
        (Happening::LimitCycle { amplitude_m: was, .. }, Outcome::LimitCycle { amplitude_m: left, .. }) => Some(1.0 - left / was),
        _ => None,
    }
}

/// Nodes that differ from the graph without a known model, where the loop without them does not do what was recorded; each node once.
fn unknown(asked: &Asked) -> Vec<(Cause, f64)> {
    if asked.reproduced {
        return Vec::new();
    }
    let cause = |place: String, evidence: String, seen: bool| Cause {
        kind: CauseKind::Unknown,
        place,
        evidence,
        without: "not known, because no model in the bag contains it".to_string(),
        holds_without: false,
        edge_without: None,
        share: None,
        seen,
        confidence: 0.0,
        repairs: Vec::new(),
    };
    let mut all: Vec<(Cause, f64)> = Vec::new();
    for difference in asked.differences.iter().filter(|d| d.kind != NodeKind::Master && !is_modelled(d)) {
        let (_, place, evidence) = named(difference, asked.graph);
        match all.iter_mut().find(|(cause, _)| cause.place == place) {
            Some((cause, _)) => cause.evidence = format!("{}; {evidence}", cause.evidence),
            None => all.push((cause(place, evidence, true), SEEN)),
        }
    }
    if all.is_empty() && asked.differences.is_empty() && !asked.shakes_again {
        let evidence = "the graph's loop does not oscillate in the re-simulation, and every node behaves as the graph states".to_string();
        all.push((cause(String::new(), evidence, false), 1.0));
    }
    all
}

/// Shares of the weights, with the gain itself as the rest where nothing else explains it.
fn weighed(asked: &Asked, mut judged: Vec<(Cause, f64)>) -> Vec<Cause> {
    let judged_by = matches!(asked.happening, Happening::NotJudged { .. });
    if !asked.happening.is_trouble() && !judged_by {
        return Vec::new();
    }
    let lowered = asked.edge.filter(|edge| *edge < asked.gain.product());
    let explained = judged.iter().any(|(_, weight)| *weight >= MOST_OF_IT);
    let gain = Cause {
        kind: CauseKind::GainTooHigh,
        place: String::new(),
        evidence: match lowered {
            Some(edge) if !asked.differences.is_empty() => {
                format!("with everything that differs from the graph the loop is stable only up to mu*lambda = {edge:.3}")
            }
            Some(edge) => format!("every node behaves as the graph states, and that loop is stable only up to mu*lambda = {edge:.3}"),
            None => "the loop of the graph oscillates at this gain".to_string(),
        },
        without: lowered.map_or_else(|| "no lower gain was found stable".to_string(), |edge| format!("stable below {edge:.3}")),
        holds_without: lowered.is_some(),
        edge_without: lowered,
        share: None,
        seen: false,
        confidence: 0.0,
        repairs: Vec::new(),
    };
    let weight = match lowered {
        _ if !asked.shakes_again => NO_EVIDENCE,
        Some(_) if explained => GAIN_BESIDE,
        Some(_) => 1.0,
        None => 0.2,
    };
    match judged_by {
        // Of a loop that was not judged only what was seen in its recording is told.
        true => judged.retain(|(cause, _)| cause.seen),
        false => judged.push((gain, weight)),
    }
    let sum: f64 = judged.iter().map(|(_, w)| w).sum();
    let trust = if asked.reproduced { 1.0 } else { 0.6 };
    let mut causes: Vec<Cause> = judged.into_iter().map(|(c, w)| Cause { confidence: trust * w / sum.max(1e-9), ..c }).collect();
    causes.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    causes
}

fn suspects(asked: &Asked) -> Vec<Suspect> {
    let mut all = Vec::new();
    for (number, difference) in asked.differences.iter().enumerate() {
        let others: Vec<Difference> = asked.differences.iter().enumerate().filter(|(i, _)| *i != number).map(|(_, d)| d.clone()).collect();
        let tuned = difference.device.as_ref().map_or(&[][..], |device| &device.tuned);
        if !tuned.is_empty() {
            all.extend(tuned.iter().map(|one| of_tuned(asked, difference, one)));
            continue;
        }
        let (kind, place, evidence) = named(difference, asked.graph);
        let repairs = if let Some(port) = &difference.way {
            vec![Change::WayRepaired { node: difference.node.clone(), port: port.clone() }]
        } else if let Some(device) = &difference.device {
            stated(asked.graph, &difference.node).filter(|_| device.files.is_some() && difference.kind == NodeKind::Slave).map_or_else(
                Vec::new,
                |files| {
                    let what = device.physics.first().map_or("it then does what its model states".to_string(), |p| {
                        format!("remove {} at {}", p.physics.replace('_', " "), p.place)
                    });
                    vec![Change::DeviceRepaired { node: difference.node.clone(), what, files: Box::new(files) }]
                },
            )
        } else {
            vec![Change::SensorRepaired { node: difference.node.clone() }]
        };
        if !is_modelled(difference) && difference.kind != NodeKind::Master {
            continue;
        }
        all.push(Suspect { kind, place, evidence, seen: true, without: as_recorded(asked.graph, &others), repairs });
    }
    all.extend(of_the_graph(asked.graph, asked.was, asked.happening));
    all
}

/// One number of a device among those that differ.
fn of_tuned(asked: &Asked, difference: &Difference, number: &Tuned) -> Suspect {
    let (kind, place, evidence) = of_number(number, &difference.node);
    let repaired = Change::NumberRepaired { node: difference.node.clone(), knob: number.knob, value: number.value };
    let mut without = as_recorded(asked.graph, asked.differences);
    repaired.apply(&mut without);
    let repairs = if number.knob.can_be_repaired() { vec![repaired] } else { Vec::new() };
    Suspect { kind, place, evidence, seen: true, without, repairs }
}

/// A device as its graph states it.
fn stated(graph: &Graph, node: &str) -> Option<DeviceFiles> {
    match &graph.node(node)?.settings {
        Settings::Master(files) | Settings::Slave(files) => Some(files.clone()),
        _ => None,
    }
}

/// Whether the re-simulated loop does what was recorded: the same word, and, where both oscillate, the same frequency.
pub fn reproduces(happening: &Happening, again: &Outcome, again_hz: Option<f64>) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= 0.15 * a.max(b) + 1.0;
    match (happening, again) {
        (Happening::Nothing | Happening::Ringing { .. }, Outcome::Stable) => true,
        (Happening::LimitCycle { frequency_hz, .. }, Outcome::LimitCycle { frequency_hz: hz, .. }) => near(*frequency_hz, *hz),
        (Happening::LimitCycle { frequency_hz, .. }, Outcome::Unstable { .. }) => again_hz.is_some_and(|hz| near(*frequency_hz, hz)),
        (Happening::RunAway { frequency_hz, .. }, Outcome::Unstable { .. } | Outcome::LimitCycle { .. }) => {
            again_hz.is_some_and(|hz| near(*frequency_hz, hz))
        }
        (Happening::Stairs { .. }, Outcome::LimitCycle { frequency_hz, .. }) => *frequency_hz < 8.0,
        (Happening::Saturation { .. }, Outcome::Limited { .. }) => true,
        // Of what was not judged nothing is contradicted.
        (Happening::NotJudged { .. }, _) => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests;
