//! What makes a loop shake: causes with their evidence, and how sure each is.
//!
//! Two kinds of evidence count. A *difference* is where the recording is not what the graph says: it was seen. An *aspect* of the graph itself
//! (a delay that it states, a grip that its canceller takes for another) was not seen to be wrong, but without it the loop would hold. For
//! both the test is the same: the loop is run again as it was, and once more without that one thing.

use crate::as_it_was::{as_it_was, is_modelled};
use crate::change::Change;
use crate::compared::AsIf;
use crate::device::DeviceFound;
use crate::differences::Difference;
use crate::happening::Happening;
use crate::trial::{Hand, Trial};
use backdrive_diagnosis::hypothesis::Family;
use backdrive_diagnosis::physics::physics_named;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_plant::model::Model;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::{Gain, ResimulateError, RunOptions};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// What can be the cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CauseKind {
    /// mu*lambda is beyond what this device, as it is, allows.
    GainTooHigh,
    /// The way is long, or the rate low.
    Delay,
    /// Samples are lost or come in bursts.
    Loss,
    /// The hand grips otherwise than the canceller assumes.
    Grip,
    /// The canceller takes out more at rest than the force puts in.
    OverCancelling,
    /// A mass that the canceller does not know.
    Inertia,
    /// A compliance that the canceller does not know.
    Compliance,
    /// Dry friction that was left out.
    DryFriction,
    /// Backlash that was left out.
    Backlash,
    /// Hysteresis that was left out.
    Hysteresis,
    /// Other physics, or other numbers, than the canceller's model has.
    OtherPhysics,
    /// A filter's lag.
    FilterLag,
    /// A coarse or noisy position.
    CoarseSensor,
    /// A sensor that stands still.
    DeadSensor,
    /// A sensor that ends at a value.
    RailedSensor,
    /// A sensor of another scale.
    ScaledSensor,
    /// A sensor whose sign is turned round.
    WrongSign,
    /// A sensor that is late.
    LateSensor,
    /// A motor at its limit, or a device at the end of its travel.
    Saturation,
    /// The clock of a node.
    Clock,
    /// Two nodes that speak on one topic.
    TwoPublishers,
    /// A node does something else than its graph says, and none of these.
    Unknown,
}

impl CauseKind {
    /// For a person.
    pub fn words(self) -> &'static str {
        match self {
            CauseKind::GainTooHigh => "the gain mu*lambda is too high for this device",
            CauseKind::Delay => "delay in the loop",
            CauseKind::Loss => "samples that are lost or come unevenly",
            CauseKind::Grip => "another grip than the canceller assumes",
            CauseKind::OverCancelling => "the canceller takes out too much at rest",
            CauseKind::Inertia => "inertia that the canceller does not know",
            CauseKind::Compliance => "compliance that the canceller does not know",
            CauseKind::DryFriction => "dry friction that was left out",
            CauseKind::Backlash => "backlash that was left out",
            CauseKind::Hysteresis => "hysteresis that was left out",
            CauseKind::OtherPhysics => "the master is not what the canceller's model says",
            CauseKind::FilterLag => "lag of a filter",
            CauseKind::CoarseSensor => "a position that is too coarse or too noisy",
            CauseKind::DeadSensor => "a dead sensor",
            CauseKind::RailedSensor => "a sensor at its rail",
            CauseKind::ScaledSensor => "a sensor of the wrong scale",
            CauseKind::WrongSign => "a signal of the wrong sign",
            CauseKind::LateSensor => "a sensor that is late",
            CauseKind::Saturation => "a limit of the device",
            CauseKind::Clock => "the clock: a node could not keep its rate",
            CauseKind::TwoPublishers => "two publishers on one topic",
            CauseKind::Unknown => "a node that does something else than the graph says",
        }
    }
}

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
    /// The loop as it was.
    pub was: &'a Trial,
    /// What differs.
    pub differences: &'a [Difference],
    /// The hand.
    pub hand: &'a Hand,
    /// The gain of the recording.
    pub gain: Gain,
    /// What happened.
    pub happening: &'a Happening,
    /// The critical mu*lambda of the loop as it was; `None` where none was found.
    pub edge: Option<f64>,
    /// Whether the loop as it was does what was recorded.
    pub reproduced: bool,
    /// Changes that every run has besides: motors without limits, where a limit hides what happens beneath.
    pub always: &'a [Change],
}

/// A thing without which the loop is run again.
struct Suspect {
    kind: CauseKind,
    place: String,
    evidence: String,
    seen: bool,
    without: Trial,
    repairs: Vec<Change>,
}

/// A difference that was seen weighs so many times as much as what the graph states.
const SEEN: f64 = 6.0;

/// How much further the edge lies without a thing counts up to this factor.
const FURTHER: f64 = 4.0;

/// Every cause, the likeliest first.
///
/// # Errors
/// A loop that cannot be run; `cancel` was set.
pub fn causes(asked: &Asked, cancel: &AtomicBool) -> Result<Vec<Cause>, ResimulateError> {
    let suspects = suspects(asked);
    let gain = asked.gain.product();
    let judged: Vec<(Cause, f64)> = suspects
        .into_par_iter()
        .map(|mut suspect| {
            asked.always.iter().for_each(|c| c.apply(&mut suspect.without));
            let run = suspect.without.run(asked.hand, asked.gain, &RunOptions::default(), cancel)?;
            let edge = if run.outcome.is_stable() { suspect.without.edge(asked.hand, gain, cancel)?.critical_gain } else { None };
            let holds = run.outcome.is_stable();
            let further = if holds { edge.map_or(FURTHER, |e| (e / gain).clamp(1.0, FURTHER)) } else { 0.05 };
            let weight = further * if suspect.seen { SEEN } else { 1.0 };
            let cause = Cause {
                kind: suspect.kind,
                place: suspect.place,
                evidence: suspect.evidence,
                without: run.outcome.to_string(),
                holds_without: holds,
                edge_without: edge,
                seen: suspect.seen,
                confidence: 0.0,
                repairs: suspect.repairs,
            };
            Ok((cause, weight))
        })
        .collect::<Result<_, ResimulateError>>()?;
    Ok(weighed(asked, judged))
}

/// Shares of the weights, with the gain itself as what is left where nothing else explains it.
fn weighed(asked: &Asked, mut judged: Vec<(Cause, f64)>) -> Vec<Cause> {
    if !asked.happening.is_trouble() {
        return Vec::new();
    }
    let lowered = asked.edge.filter(|edge| *edge < asked.gain.product());
    let gain = Cause {
        kind: CauseKind::GainTooHigh,
        place: String::new(),
        evidence: match lowered {
            Some(edge) => format!("every node does what the graph says, and that loop is stable up to mu*lambda = {edge:.3} only"),
            None => "the loop of the graph shakes at this gain".to_string(),
        },
        without: lowered.map_or_else(|| "no lower gain was found stable".to_string(), |edge| format!("stable below {edge:.3}")),
        holds_without: lowered.is_some(),
        edge_without: lowered,
        seen: false,
        confidence: 0.0,
        repairs: Vec::new(),
    };
    judged.push((gain, if lowered.is_some() { 1.0 } else { 0.2 }));
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
        let (kind, place, evidence) = named(difference, asked.graph);
        let repairs = if let Some(port) = &difference.way {
            vec![Change::WayRepaired { node: difference.node.clone(), port: port.clone() }]
        } else if difference.device.is_some() {
            Vec::new()
        } else {
            vec![Change::SensorRepaired { node: difference.node.clone() }]
        };
        if !is_modelled(difference) && difference.kind != NodeKind::Master {
            continue;
        }
        all.push(Suspect { kind, place, evidence, seen: true, without: as_it_was(asked.graph, &others), repairs });
    }
    all.extend(of_the_graph(asked));
    all
}

/// What a difference is, where, and what was seen of it.
pub fn named(difference: &Difference, graph: &Graph) -> (CauseKind, String, String) {
    let period_s = graph.period_s();
    let (node, share) = (&difference.node, 100.0 * difference.compared.share);
    let what = match (difference.kind, difference.quantity) {
        (NodeKind::Slave, crate::recorded::Quantity::Effort) => "the contact force",
        (NodeKind::Master, crate::recorded::Quantity::Position) => "the master's position",
        _ => "its output",
    };
    if let Some(port) = &difference.way {
        let place = format!("{node}.{port}");
        return match difference.compared.as_if {
            AsIf::Unsteady { late, jitter, missing } if jitter > 0 => (
                if missing > 0.3 && late == 0 { CauseKind::Loss } else { CauseKind::Delay },
                place,
                format!(
                    "what comes to {node}.{port} is {:.1} to {:.1} ms later than the graph says, and {:.0} % never comes",
                    1e3 * late as f64 * period_s,
                    1e3 * (late + jitter) as f64 * period_s,
                    100.0 * missing
                ),
            ),
            AsIf::Unsteady { late, missing, .. } if late == 0 => {
                (CauseKind::Loss, place, format!("{:.1} % of what {node}.{port} should get never comes", 100.0 * missing))
            }
            AsIf::Unsteady { late, .. } | AsIf::Changed { late, .. } => (
                CauseKind::Delay,
                place,
                format!("what comes to {node}.{port} is {:.2} ms later than the graph says", 1e3 * late as f64 * period_s),
            ),
            _ => (CauseKind::Delay, place, String::new()),
        };
    }
    if let Some(device) = &difference.device {
        return of_device(device, node, share);
    }
    let place = node.clone();
    match difference.compared.as_if {
        AsIf::Dead { from_row } => {
            (CauseKind::DeadSensor, place, format!("{what} at {node} stands still from {:.2} s on", from_row as f64 * period_s))
        }
        AsIf::Railed { low, high } => {
            let end = if high.is_finite() { high } else { low };
            (CauseKind::RailedSensor, place, format!("{what} at {node} ends at {end:.4}, where the model goes beyond"))
        }
        AsIf::Stepped { step } => {
            (CauseKind::CoarseSensor, place, format!("{what} at {node} comes in steps of {step:.3e}, which its model does not have"))
        }
        AsIf::Noisy { deviation } => {
            (CauseKind::CoarseSensor, place, format!("{what} at {node} has noise of {deviation:.3e} rms, which its model does not have"))
        }
        AsIf::Changed { gain, late: 0 } if gain < 0.0 => {
            (CauseKind::WrongSign, place, format!("{what} at {node} is {gain:.2} times what the model says: its sign is turned round"))
        }
        AsIf::Changed { gain, late: 0 } => {
            (CauseKind::ScaledSensor, place, format!("{what} at {node} is {gain:.3} times what the model says"))
        }
        AsIf::Changed { gain, late } if (gain - 1.0).abs() > 0.05 => {
            let late = 1e3 * late as f64 * period_s;
            let kind = if gain < 0.0 { CauseKind::WrongSign } else { CauseKind::ScaledSensor };
            (kind, place, format!("{what} at {node} is {gain:.3} times what the model says, and {late:.2} ms late"))
        }
        AsIf::Changed { late, .. } => {
            (CauseKind::LateSensor, place, format!("{what} at {node} is {:.2} ms late", 1e3 * late as f64 * period_s))
        }
        AsIf::Same | AsIf::Unsteady { .. } | AsIf::Otherwise => {
            (CauseKind::Unknown, place, format!("{what} at {node} differs by {share:.0} % from what its inputs make of it"))
        }
    }
}

/// What a diagnosis of the master says, as a cause.
fn of_device(device: &DeviceFound, node: &str, share: f64) -> (CauseKind, String, String) {
    let kind_of = |f: &crate::device::PhysicsFound| match (f.family, f.of_signal) {
        (Some(Family::Friction), _) => CauseKind::DryFriction,
        (Some(Family::Hysteresis), _) => CauseKind::Hysteresis,
        (Some(Family::Contact), _) => CauseKind::Backlash,
        (Some(Family::Inertia), _) => CauseKind::Inertia,
        (Some(Family::Compliance), _) => CauseKind::Compliance,
        (Some(Family::Scale), _) => CauseKind::ScaledSensor,
        (Some(Family::Lag), true) => CauseKind::LateSensor,
        (Some(Family::Limit), true) => CauseKind::Saturation,
        _ => CauseKind::OtherPhysics,
    };
    let size = |f: &crate::device::PhysicsFound| {
        f.size.as_ref().map_or_else(String::new, |(name, value, unit)| format!(", {name} {value:.4} {unit}"))
    };
    if let Some(first) = device.physics.first() {
        let text = format!(
            "the master does {share:.0} % otherwise than its model; a diagnosis of the bag finds {} at {}{} (confidence {:.2})",
            first.physics.replace('_', " "),
            first.place,
            size(first),
            first.confidence
        );
        return (kind_of(first), first.place.clone(), text);
    }
    let moved = |n: &crate::device::NumberFound| (n.found / n.declared).abs().ln().abs();
    let most = device.numbers.iter().filter(|n| n.declared != 0.0 && n.found != 0.0).max_by(|a, b| moved(a).total_cmp(&moved(b)));
    match most {
        Some(n) => {
            let kind = if n.of_grip {
                CauseKind::Grip
            } else if n.path.starts_with("bodies.") {
                CauseKind::Inertia
            } else {
                CauseKind::OtherPhysics
            };
            let text = format!(
                "the master does {share:.0} % otherwise than its model: {} is {:.4} where the graph says {:.4}",
                n.path, n.found, n.declared
            );
            (kind, n.path.clone(), text)
        }
        None => {
            let text = format!(
                "the master does {share:.0} % otherwise than its model, and a diagnosis of the bag does not say why: {}",
                device.sentence
            );
            (CauseKind::Unknown, node.to_string(), text)
        }
    }
}

/// What the graph itself states that may be too much for it.
fn of_the_graph(asked: &Asked) -> Vec<Suspect> {
    let mut all = Vec::new();
    let graph = &asked.was.graph;
    let stated = &asked.graph;
    let mut add = |kind, place: String, evidence: String, changes: Vec<Change>| {
        let mut without = asked.was.clone();
        changes.iter().for_each(|c| c.apply(&mut without));
        all.push(Suspect { kind, place, evidence, seen: false, without, repairs: changes });
    };
    let late: Vec<String> = stated
        .connections
        .iter()
        .filter(|c| c.delay > 1 || c.impairment.is_some_and(|i| i.delay_s > 0.0 || i.jitter_s > 0.0 || i.loss > 0.0))
        .map(|c| format!("{}.{}", stated.nodes[c.to.0].name, c.to.1))
        .collect();
    if !late.is_empty() {
        let ways = late.join(", ");
        add(
            CauseKind::Delay,
            ways.clone(),
            format!("the graph states delay, jitter or loss on the way to {ways}"),
            vec![Change::Delays { factor: 0.0 }],
        );
    }
    let hz = graph.timing.rate_hz;
    if hz < LOW_RATE_HZ {
        add(
            CauseKind::Delay,
            "rate".to_string(),
            format!("the loop runs at {hz:.0} Hz: one step is {:.1} ms", 1e3 / hz),
            vec![Change::Rate { hz: 10.0 * hz }],
        );
    }
    let files = |graph: &Graph, kind: NodeKind| -> Option<(DeviceFiles, f64)> {
        match graph.node_of(kind).map(|n| &n.settings) {
            Some(Settings::Master(files)) => Some((files.clone(), 0.0)),
            Some(Settings::Canceller(files, hz)) => Some((files.clone(), *hz)),
            _ => None,
        }
    };
    if let (Some((master, _)), Some((canceller, hz))) = (files(stated, NodeKind::Master), files(stated, NodeKind::Canceller))
        && let (Some(real), Some(model)) = (&master.model, &canceller.model)
    {
        if let (Some(grip), Some(assumed)) = (&master.fragment, &canceller.fragment)
            && grip.network.elements != assumed.network.elements
        {
            let right = Change::Canceller {
                of: format!("the grip {}, which the master has", grip.network.name),
                model: Some(Box::new(model.clone())),
                grip: Some(Box::new(grip.clone())),
                high_pass_hz: hz,
            };
            let text = format!("the canceller assumes the grip {}, and the master has {}", assumed.network.name, grip.network.name);
            add(CauseKind::Grip, "canceller".to_string(), text, vec![right]);
        }
        if real.elements != model.elements || real.bodies != model.bodies {
            let kind = left_out(real, model);
            let right = Change::Canceller {
                of: format!("the master's own model, {}", real.name),
                model: Some(Box::new(real.clone())),
                grip: canceller.fragment.clone().map(Box::new),
                high_pass_hz: hz,
            };
            let text = format!("the canceller predicts with {}, and the master is {}", model.name, real.name);
            add(kind, "canceller".to_string(), text, vec![right]);
        }
        if hz > 0.0 {
            let text = format!("the canceller's estimate goes through a high-pass of {hz:.1} Hz");
            add(CauseKind::FilterLag, "canceller".to_string(), text, vec![Change::HighPass { hz: 0.0 }]);
        }
    }
    let coarse = |node: &backdrive_nodes::graph::Node| match &node.settings {
        Settings::Master(files) if files.real_sensors => {
            files.model.as_ref().is_some_and(|m| m.outputs.iter().any(|o| o.resolution > 0.0 || o.noise > 0.0))
        }
        _ => false,
    };
    if stated.nodes.iter().any(coarse) {
        add(
            CauseKind::CoarseSensor,
            "master".to_string(),
            "the model states a step or noise of the position sensor".to_string(),
            vec![Change::FinerSensors],
        );
    }
    if matches!(asked.happening, Happening::Saturation { .. }) {
        add(CauseKind::Saturation, "master".to_string(), "a limit of force or rate acts".to_string(), vec![Change::StrongerMotor]);
    }
    all
}

/// A loop slower than this has its rate among the suspects, Hz.
const LOW_RATE_HZ: f64 = 2000.0;

/// Which physics one model has that another leaves out; of several the one that is worst for a prediction.
fn left_out(real: &Model, model: &Model) -> CauseKind {
    let known: Vec<&str> = model.elements.iter().map(|e| e.law.kind().name).collect();
    let more = real.elements.iter().map(|e| e.law.kind().name).filter(|k| !known.contains(k));
    let families: Vec<Family> = more.filter_map(|kind| physics_named(kind).map(|p| p.family)).collect();
    let has = |family: Family| families.contains(&family);
    if has(Family::Contact) {
        CauseKind::Backlash
    } else if has(Family::Hysteresis) {
        CauseKind::Hysteresis
    } else if has(Family::Friction) {
        CauseKind::DryFriction
    } else if real.bodies.len() > model.bodies.len() {
        CauseKind::Compliance
    } else if real.bodies != model.bodies {
        CauseKind::Inertia
    } else {
        CauseKind::OtherPhysics
    }
}

/// Whether the loop as it was does what was recorded: the same word, and, where both oscillate, the same frequency.
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
        (Happening::NotJudged { .. }, Outcome::NotJudged { .. }) => true,
        _ => false,
    }
}
