//! The answer: what happens, why, and what would stop it.

use crate::as_recorded::as_recorded;
use crate::cause::{Asked, Cause, causes, reproduces};
use crate::cause_kind::CauseKind;
use crate::change::Change;
use crate::difference::Difference;
use crate::differences::{Differences, Look, differences};
use crate::follower::explained;
use crate::happening::Happening;
use crate::named::named;
use crate::options::{Named, options};
use crate::remedy::{Remedy, doubts, remedies};
use crate::trial::{Hand, Trial};
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use backdrive_nodes::stage::Clock;
use backdrive_stability::bag_gate::models_apart;
use backdrive_stability::by_itself::alone::AloneError;
use backdrive_stability::by_itself::compared::SMALL;
use backdrive_stability::by_itself::recorded::{Recorded, Told};
use backdrive_stability::resimulate::{Gain, ResimulateError, RunOptions};
use backdrive_stability::session::Session;
use backdrive_stability::unjudged::Unjudged;
use serde::Serialize;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// The re-simulation covers at most this number of steps of a bag: many runs have to fit into half a minute.
const MOST_STEPS: usize = 60_000;

/// A bag of ours.
pub struct Question<'a> {
    /// Its signals.
    pub session: &'a Session,
    /// Its graph.
    pub graph: &'a Graph,
    /// Every sample and event.
    pub recorded: &'a Recorded,
    /// What the hand wanted, where that was recorded or recovered.
    pub intents: Option<Vec<Intent>>,
    /// The gain of most of it.
    pub gain: Gain,
    /// How long a diagnosis of the master may take on the clock.
    pub patience: Duration,
}

/// How long a diagnosis takes by default: a bag is to be answered within half a minute.
pub const PATIENCE: Duration = Duration::from_secs(14);

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum WhyError {
    /// A node cannot be run by itself.
    #[error(transparent)]
    Alone(#[from] AloneError),
    /// The loop cannot be re-simulated.
    #[error(transparent)]
    Loop(#[from] ResimulateError),
}

/// The answer.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// The bag.
    pub bag: String,
    /// mu*lambda of most of it.
    pub gain: f64,
    /// What happens.
    pub happening: Happening,
    /// In a sentence.
    pub happens: String,
    /// Causes, the likeliest first; empty where nothing happens.
    pub causes: Vec<Cause>,
    /// What would happen were there no limits of force and rate, where one acts.
    pub beneath: Option<Happening>,
    /// What would stop it, the best first.
    pub remedies: Vec<Remedy>,
    /// Where the recording differs from the graph.
    pub differences: Vec<Difference>,
    /// The same in words.
    pub differs: Vec<String>,
    /// What the recorded loop does in its re-simulation.
    pub again: Option<String>,
    /// Its signals.
    #[serde(skip)]
    pub again_signals: Option<Session>,
    /// Whether that is what was recorded.
    pub reproduced: bool,
    /// The master as found, with what holds it, where it differs from the graph: a model file.
    #[serde(skip)]
    pub master: Option<String>,
    /// The critical mu*lambda of the recorded loop; `None` where there is none within a factor of 20.
    pub edge: Option<f64>,
    /// The slave as found, where it differs from the graph and touches what the graph states: a model file.
    #[serde(skip)]
    pub slave: Option<String>,
    /// Why the loop was not re-simulated, where it was not.
    pub not_again: Option<String>,
    /// Events that nodes reported while it ran, kinds with their counts.
    pub events: Vec<(String, usize)>,
    /// What a reader has to know.
    pub notes: Vec<String>,
}

/// Answers. `hear` receives what is being done.
///
/// # Errors
/// A node that cannot be built; `cancel` was set.
pub fn why(question: &Question, hear: &(dyn Fn(&str) + Sync), cancel: &AtomicBool) -> Result<Answer, WhyError> {
    let Question { session, graph, gain, .. } = question;
    let recorded = &bounded(question);
    let happening = Happening::of(session, recorded.rows);
    // A recording that contradicts itself is no record of this loop: the place is known, and neither a search of effects in it nor a re-simulation
    // gives information.
    let contradictory = happening == Happening::NotJudged { why: Unjudged::Contradictory };
    let is_lossy = matches!(happening, Happening::NotJudged { why } if why.is_loss());
    let patience = if is_lossy { Duration::ZERO } else { question.patience };
    let Differences { found, notes } = differences(graph, recorded, &Look { small: small(graph, &happening), patience }, hear, cancel)?;
    let mut answer = Answer {
        bag: session.name.clone(),
        gain: gain.product(),
        happens: happening.to_string(),
        happening,
        causes: Vec::new(),
        beneath: None,
        remedies: Vec::new(),
        differs: found.iter().map(|d| named(d, graph).2).collect(),
        master: of_device(&found, NodeKind::Master).and_then(held),
        slave: of_device(&found, NodeKind::Slave).and_then(|files| alone_in(graph, files)),
        again: None,
        again_signals: None,
        reproduced: false,
        edge: None,
        not_again: None,
        events: counted(&recorded.events),
        differences: found,
        notes: session.notes.iter().cloned().chain(notes).collect(),
    };
    if contradictory {
        answer.not_again = Some("the recording contradicts itself or its graph".to_string());
        of_events(&mut answer, recorded);
        return Ok(answer);
    }
    if let Happening::FollowerStairs { .. } = answer.happening {
        hear("the follower on its recorded commands");
        let was = as_recorded(graph, &answer.differences);
        (answer.causes, answer.remedies, answer.reproduced) = explained(graph, was, &answer.differences, recorded, &answer.happening);
        answer.again = Some(
            if answer.reproduced { "the follower, run alone, goes in such stairs" } else { "the follower, run alone, goes smoothly" }
                .into(),
        );
        of_events(&mut answer, recorded);
        return Ok(answer);
    }
    match again(question, &mut answer, hear, cancel) {
        Ok(()) => {}
        Err(ResimulateError::Cancelled) => return Err(ResimulateError::Cancelled.into()),
        Err(e) => answer.not_again = Some(e.to_string()),
    }
    // A loop that oscillates in the recording but not in its re-simulation has a difference that is small beside its signal.
    if answer.happening.is_trouble() && !answer.reproduced && answer.not_again.is_none() {
        closer(question, recorded, &mut answer, hear, cancel)?;
    }
    let was = as_recorded(graph, &answer.differences);
    let named = Named::of(&was.graph, graph, answer.master.is_none());
    answer.remedies.iter_mut().for_each(|remedy| remedy.options = options(&remedy.changes, &named));
    of_events(&mut answer, recorded);
    // Nothing oscillates in the recording, and the graph that it is a recording of is that of another loop.
    if let (Happening::Nothing, Some(why)) = (answer.happening, models_apart(graph, session)) {
        answer.happening = Happening::NotJudged { why };
        answer.happens = answer.happening.to_string();
    }
    Ok(answer)
}

/// A difference that counts, as a share of its signal. In lockstep nothing is left to chance: where something shakes, a smaller difference is one too.
fn small(graph: &Graph, happening: &Happening) -> f64 {
    if happening.is_trouble() && graph.timing.clock == Clock::Lockstep { IN_LOCKSTEP * SMALL } else { SMALL }
}

const IN_LOCKSTEP: f64 = 0.25;

/// The device of a kind as found, where it differs from the graph.
fn of_device(found: &[Difference], kind: NodeKind) -> Option<&DeviceFiles> {
    found.iter().filter(|d| d.kind == kind).find_map(|d| d.device.as_ref()?.files.as_deref())
}

/// A slave as a model file; `None` where what it touches differs too.
fn alone_in(graph: &Graph, files: &DeviceFiles) -> Option<String> {
    let stated = graph.nodes.iter().find_map(|n| if let Settings::Slave(stated) = &n.settings { Some(stated) } else { None })?;
    (stated.fragment == files.fragment).then(|| files.model.as_ref().map(backdrive_plant::model::Model::to_toml)).flatten()
}

/// A device with what holds it, as a model file.
fn held(files: &DeviceFiles) -> Option<String> {
    let model = files.model.as_ref()?;
    Some(files.fragment.as_ref().map_or_else(|| model.clone(), |grip| model.held_by(grip).0).to_toml())
}

/// The recording up to where it leaves all bounds.
fn bounded(question: &Question) -> Recorded {
    let spans = question.session.axes.iter().map(|axis| {
        let of_hand = axis.intent.as_ref().map_or(0.0, |x| x.iter().filter(|x| x.is_finite()).fold(0.0_f64, |m, x| m.max(x.abs())));
        let travel = axis.travel.map_or(f64::INFINITY, |[low, high]| high.abs().max(low.abs()));
        if of_hand > 0.0 { (BEYOND_THE_HAND * of_hand).min(travel) } else { travel }
    });
    let bounds = spans.fold(0.0, f64::max);
    let master = question.graph.nodes.iter().position(|n| n.kind == NodeKind::Master).map(|i| question.graph.topic_of(i, "measured").name);
    question.recorded.clone().bounded(&master.unwrap_or_default(), if bounds > 0.0 { bounds } else { f64::INFINITY })
}

/// A master that is this many times as far away as the hand ever intended has run away.
const BEYOND_THE_HAND: f64 = 10.0;

/// Looks again, for differences that are ten times as small; they are kept where the loop then does what was recorded.
fn closer(
    question: &Question,
    recorded: &Recorded,
    answer: &mut Answer,
    hear: &(dyn Fn(&str) + Sync),
    cancel: &AtomicBool,
) -> Result<(), WhyError> {
    let look = Look { small: 0.1 * SMALL, patience: question.patience };
    let Differences { found, .. } = differences(question.graph, recorded, &look, hear, cancel)?;
    if found.len() <= answer.differences.len() {
        return Ok(());
    }
    let mut other = Answer {
        differs: found.iter().map(|d| named(d, question.graph).2).collect(),
        master: of_device(&found, NodeKind::Master).and_then(held),
        slave: of_device(&found, NodeKind::Slave).and_then(|files| alone_in(question.graph, files)),
        differences: found,
        causes: Vec::new(),
        remedies: Vec::new(),
        ..answer.clone()
    };
    match again(question, &mut other, hear, cancel) {
        Ok(()) if other.reproduced => *answer = other,
        Err(ResimulateError::Cancelled) => return Err(ResimulateError::Cancelled.into()),
        Ok(()) | Err(_) => {}
    }
    Ok(())
}

/// Re-simulates the loop: as found, without each suspect, with each remedy.
fn again(question: &Question, answer: &mut Answer, hear: &(dyn Fn(&str) + Sync), cancel: &AtomicBool) -> Result<(), ResimulateError> {
    let Question { session, graph, gain, .. } = question;
    if gain.product() == 0.0 {
        answer.not_again = Some("mu*lambda is 0, so there is no loop to re-simulate without the suspects".to_string());
        return Ok(());
    }
    let steps = session.len().min(MOST_STEPS) as u64;
    let hand = Hand { intents: question.intents.clone(), steps, rate_hz: graph.timing.rate_hz };
    let was: Trial = as_recorded(graph, &answer.differences);
    hear("the loop as recorded");
    let run = was.run(&hand, *gain, &RunOptions { keep_dither: true, keep_signals: true, ..RunOptions::default() }, cancel)?;
    answer.again_signals = run.signals;
    answer.again = Some(run.outcome.to_string());
    answer.reproduced = reproduces(&answer.happening, &run.outcome, run.frequency_hz);
    let mut shakes_again = answer.reproduced || !run.outcome.is_stable();
    // A limit hides what happens beneath: then the causes are looked for without it.
    let (mut loop_of_causes, mut always, mut happening) = (was.clone(), Vec::new(), answer.happening);
    let mut does = run.outcome;
    if let Happening::Saturation { .. } = happening {
        let mut unlimited = was.clone();
        Change::NoLimits.apply(&mut unlimited);
        let run = unlimited.run(&hand, *gain, &RunOptions::default(), cancel)?;
        let beneath = Happening::of_run(&run);
        does = if beneath.is_trouble() { run.outcome } else { does };
        if beneath.is_trouble() {
            (loop_of_causes, always, happening) = (unlimited, vec![Change::NoLimits], beneath);
            shakes_again = true;
        }
        answer.beneath = Some(beneath);
    }
    answer.edge = loop_of_causes.edge(&hand, gain.product(), cancel)?.critical_gain;
    // A loop that was not judged, because of what differs from its graph: what would it do without that?
    let kept_from_judgement = matches!(answer.happening, Happening::NotJudged { .. }) && !answer.differences.is_empty();
    if !answer.happening.is_trouble() && !kept_from_judgement {
        return Ok(());
    }
    shakes_again |= kept_from_judgement;
    hear("without each suspect");
    let asked = Asked {
        graph,
        was: &loop_of_causes,
        differences: &answer.differences,
        hand: &hand,
        gain: *gain,
        happening: &happening,
        again: &does,
        always: &always,
        edge: answer.edge,
        reproduced: answer.reproduced,
        shakes_again,
    };
    answer.causes = causes(&asked, cancel)?;
    // If the loop does not oscillate in its re-simulation, nothing shows what would stop the recorded oscillation.
    if !shakes_again {
        return Ok(());
    }
    hear("trying remedies");
    let unsure = doubts(&answer.differences);
    answer.remedies = remedies(&was, session, &hand, *gain, answer.edge, (&answer.causes, &unsure), cancel)?;
    Ok(())
}

fn counted(events: &[Told]) -> Vec<(String, usize)> {
    let mut all: Vec<(String, usize)> = Vec::new();
    for event in events {
        match all.iter_mut().find(|(kind, _)| *kind == event.kind) {
            Some((_, count)) => *count += 1,
            None => all.push((event.kind.clone(), 1)),
        }
    }
    all
}

/// Causes that the nodes themselves reported: they are known without any re-simulation.
fn of_events(answer: &mut Answer, recorded: &Recorded) {
    let cause = |kind: CauseKind, place: String, evidence: String| Cause {
        kind,
        place,
        evidence,
        without: "not re-simulated: it is not part of a model".to_string(),
        holds_without: false,
        edge_without: None,
        share: None,
        seen: true,
        confidence: 0.0,
        repairs: Vec::new(),
    };
    let mut told = Vec::new();
    let twice = recorded.tracks.iter().filter(|t| t.sources.len() > 1);
    told.extend(
        twice.map(|t| cause(CauseKind::TwoPublishers, t.topic.clone(), format!("{} publishers send on {}", t.sources.len(), t.topic))),
    );
    if let Some(event) = recorded.events.iter().find(|e| e.kind == "connection_broken" && e.text.contains("another publisher")) {
        told.push(cause(CauseKind::TwoPublishers, event.topic.clone(), event.text.clone()));
    }
    let skipped: f64 = recorded.events.iter().filter(|e| e.kind == "steps_skipped").map(|e| e.value).sum();
    if skipped > 0.0 {
        told.push(cause(CauseKind::Clock, String::new(), format!("{skipped:.0} steps were skipped because a node was too far behind")));
    }
    if told.is_empty() {
        return;
    }
    if !answer.happening.is_trouble() {
        answer.differs.extend(told.into_iter().map(|c| c.evidence));
        return;
    }
    // A reported cause weighs as much as everything that was inferred.
    let share = 0.8;
    answer.causes.iter_mut().for_each(|c| c.confidence *= 1.0 - share);
    let each = share / told.len() as f64;
    told.iter_mut().for_each(|c| c.confidence = each);
    told.append(&mut answer.causes);
    answer.causes = told;
}
