//! One verdict from three answers: frequency response, re-simulation, energy; with the reason, and where they disagree.
//!
//! Which answer leads:
//! - Where the models in the bag do what the recording shows, the re-simulation: it knows friction, contact and clamps.
//! - Where they do not, the frequency response, which needs no model; the disagreement is told, for it is the first sign of
//!   physics that the models leave out.
//! - Where neither tells, it cannot be told, and the answer says what to record.
//!
//! The method that leads gives the reason; the headline (verdict, edge, frequency) is then the least favourable of all that counts: see
//! [`crate::headline`]. A recording that is cut short, has holes in it or never touched anything gives no green answer, whatever a method says.
//!
//! Energy never leads: passivity is enough for stability, and not needed for it.

use crate::collect::way;
use crate::energy::{EnergyAnswer, EnergyVerdict, energy};
use crate::frequency::{self, CannotTell, Frequency, FrequencyAnswer, FrequencyError, Parts};
use crate::headline::Witness;
use crate::model_check::{PartCheck, check};
use crate::outcome::{Outcome, Trace, judge};
use crate::phases::contacts;
use crate::resimulate::edge::{Edge, Search, edge};
use crate::resimulate::grips::{GripEdge, grips};
use crate::resimulate::over_cancelling::{OverCancelling, over_cancelling};
use crate::resimulate::script::Script;
use crate::resimulate::{Gain, ResimulateError, RunOptions, Scenario};
use crate::session::Session;
use crate::transparency::{Transparency, transparency};
use crate::unjudged::{Gaps, Unjudged};
use backdrive_control::margins::Margins;
use backdrive_control::operator::Intent;
use backdrive_nodes::build::BuildError;
use backdrive_nodes::graph::{DeviceFiles, Graph, NodeKind, Settings};
use serde::Serialize;
use serde_json::{Value, json};
use std::sync::atomic::AtomicBool;

/// What is asked.
#[derive(Debug, Clone)]
pub struct Question<'a> {
    /// What was recorded.
    pub session: &'a Session,
    /// The graph that recorded it; `None` for a bag without models.
    pub recorded: Option<&'a Graph>,
    /// The same with parts exchanged.
    pub asked: Option<&'a Graph>,
    /// Which parts those are.
    pub swapped: Swapped,
    /// The hand's motion, per axis; `None` where it is not known.
    pub intents: Option<Vec<Intent>>,
    /// A hand to play in place of the recorded one.
    pub script: Option<Script>,
    /// The gains asked about.
    pub gain: Gain,
    /// Factors on the grip over which the answer is given; empty for none.
    pub grips: Vec<f64>,
    /// Where the edge is looked for.
    pub search: Search,
}

/// Parts that are not those that recorded the bag.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Swapped {
    /// The master or its grip.
    pub master: bool,
    /// The canceller or the grip it assumes.
    pub canceller: bool,
    /// The slave or what it touches.
    pub slave: bool,
}

impl Swapped {
    fn any(&self) -> bool {
        self.master || self.canceller || self.slave
    }
}

/// The verdict's word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// Stable.
    Stable,
    /// It oscillates and does not grow.
    LimitCycle,
    /// It grows.
    Unstable,
    /// A clamp or the travel decides, not the loop.
    Limited,
    /// The recording does not tell.
    CannotTell,
}

impl Word {
    /// As in JSON.
    pub fn text(self) -> &'static str {
        match self {
            Word::Stable => "stable",
            Word::LimitCycle => "limit_cycle",
            Word::Unstable => "unstable",
            Word::Limited => "limited",
            Word::CannotTell => "cannot_tell",
        }
    }

    /// Of what a run did.
    pub fn of(outcome: &Outcome) -> Word {
        match outcome {
            Outcome::Stable => Word::Stable,
            Outcome::LimitCycle { .. } => Word::LimitCycle,
            Outcome::Unstable { .. } => Word::Unstable,
            Outcome::Limited { .. } => Word::Limited,
            Outcome::NotJudged { .. } => Word::CannotTell,
        }
    }
}

/// Which answer leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The loop run again with the models in the bag.
    Resimulation,
    /// The measured frequency response.
    Frequency,
    /// The recording itself, at the gain asked.
    Recording,
    /// None.
    Nothing,
}

/// Two things that do not go together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Disagreement {
    /// `model` where a model does not do what was recorded; `methods` where two answers differ.
    pub kind: &'static str,
    /// In a sentence.
    pub text: String,
}

/// The loop that was measured beside the loop that the models make of the same session.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LoopCheck {
    /// RMS of the relative difference over the lines near the edge.
    pub difference: f64,
    /// What the noise of both explains of it.
    pub noise: f64,
    /// Whether they agree.
    pub agrees: bool,
}

/// The re-simulation's part of the answer.
#[derive(Debug, Clone)]
pub struct Resimulated {
    /// What happened at the gain asked.
    pub outcome: Outcome,
    /// Its signals.
    pub signals: Session,
    /// Where it stops being stable.
    pub edge: Edge,
    /// The same for other grips.
    pub grips: Vec<GripEdge>,
    /// Whether the canceller takes out too much at rest.
    pub over_cancelling: Option<OverCancelling>,
    /// Energy at the gain asked.
    pub energy: EnergyAnswer,
    /// What the hand does.
    pub script: String,
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The bag.
    pub bag: String,
    /// The gains asked about.
    pub gain: Gain,
    /// mu*lambda at which it was recorded: lowest and highest.
    pub recorded_gain: Option<[f64; 2]>,
    /// The verdict.
    pub verdict: Word,
    /// Why, in a sentence or two.
    pub reason: String,
    /// Which answer leads.
    pub from: Method,
    /// The lowest mu*lambda at which it is not stable; `None` where there is none in the range, or it is not known.
    pub critical_gain: Option<f64>,
    /// Where there is none: it is at least this.
    pub at_least: Option<f64>,
    /// Where a clamp or the travel ends the stable range before any oscillation does: from this mu*lambda on.
    pub limited_from: Option<f64>,
    /// 95 % interval; an open upper end is `None`.
    pub critical_gain_ci95: Option<(f64, Option<f64>)>,
    /// Frequency on the edge, Hz; 0 where it runs away without oscillating.
    pub critical_frequency_hz: Option<f64>,
    /// Margins at the gain asked, by the measured frequency response.
    pub margins: Option<Margins>,
    /// The frequency response's answer at the gain.
    pub frequency_answer: Option<FrequencyAnswer>,
    /// The frequency response.
    pub frequency: Option<Frequency>,
    /// The re-simulation.
    pub resimulated: Option<Resimulated>,
    /// Why there is none.
    pub no_resimulation: Option<String>,
    /// What the recording itself did at its own gain.
    pub recorded_outcome: Option<Outcome>,
    /// Energy as recorded.
    pub recorded_energy: EnergyAnswer,
    /// Transparency as recorded, per axis.
    pub transparency: Vec<Transparency>,
    /// How well each device's model tells the device.
    pub checks: Vec<PartCheck>,
    /// How well the models tell the loop.
    pub loop_check: Option<LoopCheck>,
    /// Where answers and models part.
    pub disagreements: Vec<Disagreement>,
    /// What a reader has to know.
    pub warnings: Vec<String>,
    /// What to record for a better answer.
    pub advice: Option<String>,
    /// What in the recording keeps a green answer back; `None` where nothing does, or the answer was not green.
    pub held_back: Option<Unjudged>,
    /// Everything that counted, the method that leads first.
    pub witnesses: Vec<Witness>,
    /// Whose edge and frequency the headline has.
    pub decided_by: Option<String>,
}

/// Why there is no answer at all.
#[derive(Debug, thiserror::Error)]
pub enum AnswerError {
    /// Of the session.
    #[error(transparent)]
    Frequency(#[from] FrequencyError),
    /// Of the loop that is run again.
    #[error(transparent)]
    Resimulate(#[from] ResimulateError),
    /// Of a device.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// Hears what is being done, and how much of it is done.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Answers a question.
///
/// # Errors
/// A session without rows, a part that cannot be exchanged or run, or `cancel` was set.
pub fn answer(question: &Question, progress: Progress, cancel: &AtomicBool) -> Result<Answer, AnswerError> {
    let Question { session, recorded, asked, swapped, .. } = question;
    progress("frequency response", 0, 1);
    let parts = asked.map(|graph| exchanged(graph, *swapped)).unwrap_or_default();
    let frequency = frequency::analyse(session, &frequency::Options { parts, ..Default::default() })?;
    progress("models against the recording", 0, 1);
    let with_hand = with_recovered_hand(question);
    let checks = recorded.map(|graph| check(graph, with_hand.as_ref().unwrap_or(session))).transpose()?.unwrap_or_default();
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
fn exchanged(graph: &Graph, swapped: Swapped) -> Parts<'_> {
    let files = |kind: NodeKind| graph.node_of(kind).map(|n| &n.settings);
    let device = |kind: NodeKind| -> Option<&DeviceFiles> {
        match files(kind) {
            Some(Settings::Master(files) | Settings::Slave(files)) => Some(files),
            _ => None,
        }
    };
    Parts {
        canceller: match files(NodeKind::Canceller) {
            Some(Settings::Canceller(files, corner)) if swapped.canceller => Some((files, *corner)),
            _ => None,
        },
        master: device(NodeKind::Master).filter(|_| swapped.master),
        slave: device(NodeKind::Slave).filter(|_| swapped.slave),
    }
}

fn scenario(question: &Question) -> Result<Scenario, String> {
    let Some(graph) = question.asked else { return Err("the bag holds no models".to_string()) };
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
    progress("the gain asked", 0, 1);
    let keep = RunOptions { keep_signals: true, ..RunOptions::default() };
    let run = scenario.run(question.gain, &keep, cancel)?;
    let signals = run.signals.unwrap_or_else(|| question.session.clone());
    let options = RunOptions::default();
    let edge = edge(scenario, &question.search, &options, &|done, all| progress("the edge", done, all), cancel)?;
    let asked = Some(question.gain.product());
    let others: Vec<f64> = question.grips.iter().copied().filter(|s| *s != 1.0).collect();
    // For other grips the edge need not be as exact.
    let coarse = Search { tolerance: 0.02, per_decade: 20, whole_grid: false, ..question.search };
    let grips = grips(scenario, &others, asked, &coarse, &options, &|done, all| progress("other grips", done, all), cancel)?;
    let over_cancelling = over_cancelling(scenario, &question.grips, asked, &options, cancel).ok();
    let energy = energy(&signals, Some(scenario.graph()), None);
    Ok(Resimulated { outcome: run.outcome, signals, edge, grips, over_cancelling, energy, script: scenario.script().to_string() })
}

/// The loop measured in the bag beside the same measurement on what the models make of the same session, dither and all.
fn loop_check(scenario: &Scenario, question: &Question, answer: &Answer, cancel: &AtomicBool) -> Result<Option<LoopCheck>, AnswerError> {
    let Some(measured) = &answer.frequency else { return Ok(None) };
    let rows = question.session.len();
    let (mu, lambda) = (question.session.mu.get(rows / 2), question.session.lambda.get(rows / 2));
    let (Some(mu), Some(lambda)) = (mu, lambda) else { return Ok(None) };
    let options = RunOptions { keep_dither: true, keep_signals: true, ..RunOptions::default() };
    if !(mu * lambda).is_finite() || question.script.is_some() {
        return Ok(None);
    }
    let run = scenario.run(Gain { mu: *mu, lambda: *lambda }, &options, cancel)?;
    let Some(signals) = run.signals else { return Ok(None) };
    let options = frequency::Options { draws: 50, ..Default::default() };
    let modelled = frequency::analyse(&signals, &options)?;
    Ok(compare_loops(measured, &modelled))
}

/// Relative difference of two loops beyond which they are not the same.
const SAME_LOOP: f64 = 0.04;

fn compare_loops(measured: &Frequency, modelled: &Frequency) -> Option<LoopCheck> {
    let (mut difference, mut noise, mut count) = (0.0, 0.0, 0.0);
    let centre = measured.edge.frequency_hz.filter(|f| *f > 0.0);
    for (a, b) in measured.levels.iter().zip(&modelled.levels) {
        for (x, y) in a.axes.iter().zip(&b.axes) {
            for (i, hz) in a.hz.iter().enumerate() {
                let near = centre.is_none_or(|c| (c / 3.0..c * 3.0).contains(hz));
                let Some(j) = b.hz.iter().position(|f| (f - hz).abs() < 1e-6) else { continue };
                if !near || !x.told[i] || !y.told[j] {
                    continue;
                }
                let (p, q) = (x.l[i], y.l[j]);
                let power = p[0] * p[0] + p[1] * p[1];
                difference += ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)) / power;
                noise += 2.0 * (x.sigma[i].powi(2) + y.sigma[j].powi(2)) / power;
                count += 1.0;
            }
        }
    }
    if count < 3.0 {
        return None;
    }
    let (difference, noise) = (f64::sqrt(difference / count), f64::sqrt(noise / count));
    Some(LoopCheck { difference, noise, agrees: difference <= SAME_LOOP || difference <= 2.0 * noise })
}

/// What the recording itself did: the same function as for a live run. What is missing in a recording is no run-away.
fn recorded_outcome(session: &Session) -> Option<Outcome> {
    let intents: Vec<Vec<f64>> = session.axes.iter().map(|a| a.intent.clone().unwrap_or_default()).collect();
    let way = (intents.len() > 1).then(|| way(&intents.iter().map(|x| held(x)).collect::<Vec<_>>()));
    let judged = session.axes.iter().map(|axis| {
        let stale = |row: usize| axis.stale.get(row).copied().unwrap_or(false);
        let intent = axis.intent.as_ref().filter(|x| x.iter().any(|x| x.is_finite()));
        let loops = || [Some(&axis.master), Some(&axis.contact), Some(&axis.command), intent].into_iter().flatten();
        let lacks = |row: usize| stale(row) || loops().any(|c| c.get(row).is_none_or(|x| x.is_nan()));
        let touched = !contacts(axis, session.period_s).is_empty();
        let trace = Trace {
            period_s: session.period_s,
            intent: way.clone().unwrap_or_else(|| axis.intent.as_deref().map(held).unwrap_or_default()),
            position: held(&axis.master),
            contact: if touched { held(&axis.contact) } else { vec![0.0; axis.contact.len()] },
            feedback: held(&axis.force),
            dither: axis.dither.clone().unwrap_or_default(),
            // A stale input opens the loop and limits nothing.
            clamped: axis.clamped.iter().enumerate().map(|(row, acted)| *acted && !stale(row)).collect(),
            travel: axis.travel,
            resolution: axis.resolution,
            noise: axis.noise,
            gaps: Gaps { at: (0..session.len()).map(lacks).collect(), bridged_s: session.bridged_s, planned: 0 },
        };
        judge(&trace).held_back(session.cut_short)
    });
    Outcome::worst(judged)
}

/// The column with what is missing in it filled by the value before it.
fn held(column: &[f64]) -> Vec<f64> {
    let mut before = column.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
    let value = |x: &f64| {
        before = if x.is_finite() { *x } else { before };
        before
    };
    column.iter().map(value).collect()
}

/// Why the measured response and the loop that is run again may give different edges.
fn why_apart(swapped: Swapped, amplitude_dependent: bool, model_is_off: bool) -> &'static str {
    match () {
        () if model_is_off => {
            "The models do not do what was recorded, so that the re-simulation lacks something that the measured loop has"
        }
        () if amplitude_dependent => "The measured edge depends on the amplitude of the dither: such a loop has an edge for each motion",
        () if swapped.any() => "The exchanged parts enter the frequency response linearised, and the re-simulation as they are",
        () => {
            "The frequency response is that of the dither's small motion in contact; the re-simulation goes through the hand's whole motion, in which \
             friction, hysteresis and touching differ"
        }
    }
}

impl Answer {
    fn of(question: &Question, frequency: Frequency, checks: Vec<PartCheck>) -> Answer {
        let session = question.session;
        let gains = (0..session.len()).map(|row| session.gain(row)).filter(|g| g.is_finite());
        let range = gains.fold(None, |r: Option<[f64; 2]>, g| Some(r.map_or([g, g], |[a, b]| [a.min(g), b.max(g)])));
        let mut warnings = session.notes.clone();
        // That the edge depends on the amplitude is told below, with the numbers.
        warnings.extend(frequency.notes.iter().filter(|n| !n.starts_with("the edge depends on the amplitude")).cloned());
        let mut told = std::collections::HashSet::new();
        warnings.retain(|w| told.insert(w.clone()));
        if frequency.relative {
            warnings.push("the gains of the recording are not known: every gain is in multiples of the recorded one".to_string());
        }
        let recorded_outcome = recorded_outcome(session);
        let mut frequency = frequency;
        if let Some(Outcome::Unstable { growth_per_s }) = recorded_outcome {
            warnings.push(format!("with its dither and at its own gain the recording grows, by {growth_per_s:.2} per second"));
            frequency.cannot_tell = Some(CannotTell {
                reason: "the recording itself runs away, so it holds no steady response".to_string(),
                advice: Some("record at a lower gain, or with a smaller dither".to_string()),
            });
        }
        let frequency_answer = frequency.at(question.gain.product());
        Answer {
            bag: session.name.clone(),
            gain: question.gain,
            recorded_gain: range,
            verdict: Word::CannotTell,
            reason: String::new(),
            from: Method::Nothing,
            critical_gain: None,
            at_least: None,
            limited_from: None,
            critical_gain_ci95: None,
            critical_frequency_hz: None,
            margins: frequency_answer.margins,
            advice: frequency_answer.advice.clone(),
            frequency_answer: Some(frequency_answer),
            frequency: Some(frequency),
            resimulated: None,
            no_resimulation: None,
            recorded_outcome,
            recorded_energy: energy(session, question.recorded, None),
            transparency: transparency(session, question.recorded),
            checks,
            loop_check: None,
            disagreements: Vec::new(),
            warnings,
            held_back: None,
            witnesses: Vec::new(),
            decided_by: None,
        }
    }

    /// Whether the recording itself runs away: then it is no record of a steady loop.
    fn runs_away(&self) -> bool {
        matches!(self.recorded_outcome, Some(Outcome::Unstable { .. }))
    }

    /// Whether the models that are not exchanged do what was recorded.
    fn models_agree(&self, swapped: Swapped) -> bool {
        let counts = |c: &&PartCheck| !(c.part == "master" && swapped.master || c.part == "slave" && swapped.slave);
        self.checks.iter().filter(counts).all(|c| c.agrees) && self.loop_check.is_none_or(|c| c.agrees)
    }

    /// Whether the recording says anything of the models.
    fn models_are_checked(&self) -> bool {
        !self.checks.is_empty() || self.loop_check.is_some()
    }

    fn conclude(&mut self, swapped: Swapped) {
        let agree = self.models_agree(swapped);
        self.find_disagreements(swapped);
        let judged = self.resimulated.as_ref().is_some_and(|r| !matches!(r.outcome, Outcome::NotJudged { .. }));
        let told = self.frequency_answer.as_ref().is_some_and(|a| a.verdict != frequency::Verdict::CannotTell);
        let measured = self.frequency.as_ref().is_some_and(|f| f.cannot_tell.is_none());
        match (&self.resimulated, agree && self.models_are_checked()) {
            (Some(_), true) if judged => self.by_resimulation(),
            _ if measured => self.by_frequency(),
            (Some(again), true) => {
                let why = again.outcome.to_string();
                self.untold(&format!("when the loop is run again {why}; and the recording holds no excitation that tells the loop"));
            }
            (Some(_), false) if agree => {
                self.untold("nothing in the recording says whether its models are right, and it holds no excitation that tells the loop")
            }
            (Some(_), false) => {
                self.untold("the models in the bag do not do what was recorded, and it holds no excitation that tells the loop")
            }
            _ => self.untold("there is no loop to run again, and the recording holds no excitation that tells the loop"),
        }
        self.least_favourable();
        self.name_the_edge();
        self.by_the_recording();
        self.hold_back();
        // Where the loop was not measured at all, how to measure it is worth saying even beside a verdict.
        if told || (measured && self.verdict != Word::CannotTell) {
            self.advice = None;
        }
        if let Some(why) = self.held_back {
            self.advice = Some(why.advice().to_string());
        }
        self.warn();
    }

    fn by_resimulation(&mut self) {
        let Some(again) = &self.resimulated else { return };
        self.from = Method::Resimulation;
        self.verdict = Word::of(&again.outcome);
        self.reason = format!("{} when the loop is run again with {}", again.outcome, again.script);
        let edge = &again.edge;
        match edge.critical_gain {
            Some(critical) => {
                self.critical_gain = Some(critical);
                self.critical_gain_ci95 = self.interval_about(critical);
                self.critical_frequency_hz = edge.frequency_hz;
            }
            None => {
                self.at_least = Some(edge.at_least);
                self.reason += &format!("; {}", edge.reason);
            }
        }
    }

    /// The interval of a re-simulated edge: as wide as the recording leaves the loop near its crossover uncertain.
    pub(crate) fn interval_about(&self, critical: f64) -> Option<(f64, Option<f64>)> {
        let frequency = self.frequency.as_ref().filter(|f| f.cannot_tell.is_none())?;
        let measured = match (frequency.edge.gain, frequency.edge.ci95) {
            (Some(gain), Some((low, high))) if !frequency.amplitude_dependent => Some((low / gain, high.map(|h| h / gain))),
            _ => None,
        };
        let difference = self.loop_check.map(|c| (1.0 - 2.0 * c.difference.max(0.005), Some(1.0 + 2.0 * c.difference.max(0.005))));
        let Some((low, high)) = measured.or(difference) else {
            // Nothing of the loop stands out of the noise: then the recording gives a lower end only.
            return frequency.edge.at_least.map(|least| (least.min(critical), None));
        };
        let (low, high) = (critical * low.max(0.0), high.map(|h| critical * h));
        // Where the verdict flickers the edge is no point.
        let highest = self.resimulated.as_ref().and_then(|r| r.edge.flickers).map_or(0.0, |[_, highest]| highest * 1.01);
        Some((low, high.map(|h| h.max(highest))))
    }

    fn by_frequency(&mut self) {
        let (Some(answer), Some(frequency)) = (&self.frequency_answer, &self.frequency) else { return };
        self.from = Method::Frequency;
        self.verdict = match answer.verdict {
            frequency::Verdict::Stable => Word::Stable,
            frequency::Verdict::Unstable => Word::Unstable,
            frequency::Verdict::CannotTell => Word::CannotTell,
        };
        self.reason = format!("by the measured frequency response: {}", answer.reason);
        (self.critical_gain, self.at_least) = (answer.critical_gain, answer.at_least);
        (self.critical_gain_ci95, self.critical_frequency_hz) = (answer.critical_gain_ci95, answer.frequency_hz);
        if frequency.amplitude_dependent {
            self.reason += "; the edge depends on the amplitude, so it is an interval over those measured";
        }
        // A clamp limits whatever the model lacks.
        if let (Word::Stable, Some(Outcome::Limited { .. })) = (self.verdict, self.resimulated.as_ref().map(|r| r.outcome)) {
            self.verdict = Word::Limited;
            self.reason += "; when the loop is run again a clamp acts or the travel is left, which is never stable";
        }
    }

    fn untold(&mut self, why: &str) {
        self.verdict = Word::CannotTell;
        let more = self.frequency_answer.as_ref().map(|a| a.reason.clone()).filter(|r| !r.is_empty());
        self.reason = more.map_or(why.to_string(), |more| format!("{why} ({more})"));
    }

    /// What is cut short, has holes or never touched anything says nothing for a loop; what it says against one stands.
    fn hold_back(&mut self) {
        let Some(Outcome::NotJudged { why }) = self.recorded_outcome else { return };
        // A hand that never holds still moves the loop all the same, and a frequency response is told from that.
        if self.verdict != Word::Stable || why == Unjudged::NoHold {
            return;
        }
        self.verdict = Word::CannotTell;
        self.reason = format!("the recording does not allow a green answer: {why}; of what there is: {}", self.reason);
        self.held_back = Some(why);
    }

    /// At the very gain of the recording the recording itself is the best witness, where it speaks against.
    fn by_the_recording(&mut self) {
        let Some([low, high]) = self.recorded_gain else { return };
        let asked = self.gain.product();
        let same = (low / asked - 1.0).abs() < 0.01 && (high / asked - 1.0).abs() < 0.01;
        let Some(outcome) = self.recorded_outcome.filter(|o| same && !o.is_stable() && !matches!(o, Outcome::NotJudged { .. })) else {
            return;
        };
        if self.verdict == Word::Stable || self.verdict == Word::CannotTell {
            self.reason = format!("at this very gain the recording itself shows: {outcome}; otherwise {}", self.reason);
            (self.verdict, self.from) = (Word::of(&outcome), Method::Recording);
        }
    }

    fn find_disagreements(&mut self, swapped: Swapped) {
        let mut found = Vec::new();
        for check in self.checks.iter().filter(|c| !c.agrees) {
            found.push(Disagreement { kind: "model", text: format!("{check}: the model leaves something out or its numbers are wrong") });
        }
        if let Some(check) = self.loop_check.filter(|c| !c.agrees) {
            let (is, explained) = (100.0 * check.difference, 100.0 * check.noise);
            let text =
                format!("near the edge the measured loop is {is:.1} % off the loop that the models make ({explained:.1} % would be noise)");
            found.push(Disagreement { kind: "model", text });
        }
        if let (Some(answer), Some(again)) = (&self.frequency_answer, &self.resimulated) {
            let beyond = |outcome: &Outcome| matches!(outcome, Outcome::LimitCycle { .. } | Outcome::Unstable { .. });
            let differ = match answer.verdict {
                frequency::Verdict::Stable => beyond(&again.outcome),
                frequency::Verdict::Unstable => again.outcome.is_stable(),
                frequency::Verdict::CannotTell => false,
            };
            if differ {
                let says = if answer.verdict == frequency::Verdict::Stable { "stable" } else { "unstable" };
                let text =
                    format!("at mu*lambda = {:.3} the frequency response says {says}, the re-simulation {}", answer.gain, again.outcome);
                found.push(Disagreement { kind: "methods", text });
            }
            let apart = match (answer.critical_gain_ci95, again.edge.critical_gain) {
                (Some((low, high)), Some(edge)) => edge < 0.95 * low || high.is_some_and(|h| edge > 1.05 * h),
                (None, Some(edge)) => answer.at_least.is_some_and(|least| edge < 0.95 * least),
                (Some((_, Some(high))), None) => again.edge.at_least > 1.05 * high,
                _ => false,
            };
            if apart {
                let edge = |gain: Option<f64>, least: Option<f64>| match (gain, least) {
                    (Some(gain), _) => format!("{gain:.3}"),
                    (None, Some(least)) => format!("above {least:.3}"),
                    (None, None) => "nowhere".to_string(),
                };
                let text = format!(
                    "the edge is {} by the frequency response and {} by the re-simulation: act on the lower. {}",
                    edge(answer.critical_gain, answer.at_least),
                    edge(again.edge.critical_gain, Some(again.edge.at_least)),
                    why_apart(swapped, answer.amplitude_dependent, found.iter().any(|d: &Disagreement| d.kind == "model"))
                );
                found.push(Disagreement { kind: "methods", text });
            }
        }
        self.disagreements = found;
    }

    fn warn(&mut self) {
        if self.from == Method::Resimulation && self.frequency.as_ref().is_some_and(|f| f.cannot_tell.is_some()) {
            let why = "the loop itself was not measured: this is what the models in the bag say, which do what was recorded";
            self.warnings.push(why.to_string());
        }
        if let Some(again) = &self.resimulated {
            let asked = self.gain.product();
            let fails: Vec<String> = again
                .grips
                .iter()
                .filter_map(|g| g.at_asked.filter(|o| !o.is_stable()).map(|o| format!("{} of the grip: {o}", g.scale)))
                .collect();
            if !fails.is_empty() && again.outcome.is_stable() {
                self.warnings
                    .push(format!("stable with this grip, but not with every grip at mu*lambda = {asked:.3}: {}", fails.join("; ")));
            }
            self.warnings.extend(again.over_cancelling.as_ref().and_then(|o| o.warning.clone()));
            if let Some([lowest, highest]) = again.edge.flickers {
                self.warnings
                    .push(format!("from mu*lambda = {lowest:.3} to {highest:.3} the verdict changes with the gain more than once"));
            }
            if let Some(gain) = again.edge.returns_to_stable.filter(|g| again.edge.flickers.is_none_or(|[_, h]| *g > h)) {
                self.warnings.push(format!("beyond its edge the loop is stable again at mu*lambda = {gain:.3}: do not rely on it"));
            }
        }
        if let Some(frequency) = self.frequency.as_ref().filter(|f| f.amplitude_dependent) {
            let levels: Vec<String> = frequency
                .levels
                .iter()
                .filter_map(|l| l.edge.gain.or(l.edge.at_least).map(|g| format!("{g:.3} at {:.3} rms", l.amplitude_rms)))
                .collect();
            self.warnings.push(format!(
                "the edge depends on the dither's amplitude ({}): friction, hysteresis or backlash is in the loop",
                levels.join(", ")
            ));
        }
    }

    /// Whether a model does something else than was recorded.
    pub fn mismatch(&self) -> bool {
        self.disagreements.iter().any(|d| d.kind == "model")
    }

    /// For scripts.
    pub fn json(&self) -> Value {
        let again = self.resimulated.as_ref();
        let frequency = self.frequency_answer.as_ref();
        // One margin: to the headline's edge. Those of the measured response beside it where they are of the same edge.
        let margins = self.margins.as_ref().filter(|_| self.margins_are_of_the_edge());
        let cycle = again.filter(|_| self.from == Method::Resimulation).map(|a| a.outcome);
        let cycle = if self.from == Method::Recording { self.recorded_outcome } else { cycle };
        let limit_cycle = match cycle {
            Some(Outcome::LimitCycle { amplitude_m, frequency_hz }) => json!({ "amplitude_m": amplitude_m, "frequency_hz": frequency_hz }),
            _ => Value::Null,
        };
        let growth = match cycle {
            Some(Outcome::Unstable { growth_per_s }) => json!(growth_per_s),
            _ => Value::Null,
        };
        let energy = |e: &EnergyAnswer| json!({ "verdict": e.verdict, "reason": e.reason });
        json!({
            "bag": self.bag,
            "gain": self.gain.product(),
            "mu": self.gain.mu,
            "lambda": self.gain.lambda,
            "recorded_gain": self.recorded_gain,
            "verdict": self.verdict,
            "reason": self.reason,
            "from": self.from,
            "critical_gain": self.critical_gain,
            "at_least": self.at_least,
            "limited_from": self.limited_from,
            "critical_gain_ci95": self.critical_gain_ci95,
            "critical_frequency_hz": self.critical_frequency_hz,
            "margins": {
                "gain_db": self.gain_margin_db(),
                "phase_deg": margins.and_then(|m| m.phase_deg),
                "delay_ms": margins.and_then(|m| m.delay_ms),
                "modulus": margins.map(|m| m.modulus),
            },
            "limit_cycle": limit_cycle,
            "growth_per_s": growth,
            "methods": {
                "frequency": frequency.map(|f| json!({
                    "verdict": f.verdict,
                    "reason": f.reason,
                    "critical_gain": f.critical_gain,
                    "at_least": f.at_least,
                    "critical_gain_ci95": f.critical_gain_ci95,
                    "frequency_hz": f.frequency_hz,
                    "margins": self.margins,
                    "amplitude_dependent": f.amplitude_dependent,
                    "method": self.frequency.as_ref().map(|f| &f.method),
                    "delays": self.frequency.as_ref().map(|f| &f.delays),
                    "levels": self.frequency.as_ref().map(|f| f.levels.iter().map(|l| json!({ "dither_rms": l.amplitude_rms, "edge": l.edge })).collect::<Vec<_>>()),
                    "axes": self.frequency.as_ref().and_then(|f| f.levels.last()).map(|l| l.axes.iter().map(|a| json!({ "axis": a.name, "edge": a.edge })).collect::<Vec<_>>()),
                })),
                "resimulation": match again {
                    Some(a) => json!({
                        "verdict": Word::of(&a.outcome),
                        "outcome": a.outcome,
                        "script": a.script,
                        "critical_gain": a.edge.critical_gain,
                        "frequency_hz": a.edge.frequency_hz,
                        "at_least": a.edge.at_least,
                        "limited_from": a.edge.limited_from,
                        "returns_to_stable": a.edge.returns_to_stable,
                        "reason": a.edge.reason,
                    }),
                    None => json!({ "verdict": Word::CannotTell, "reason": self.no_resimulation }),
                },
                "energy": match again {
                    Some(a) => energy(&a.energy),
                    None => energy(&self.recorded_energy),
                },
                "recording": self.recorded_outcome.map(|o| json!({ "verdict": Word::of(&o), "outcome": o })),
            },
            "grips": again.map(|a| a.grips.iter().map(|g| json!({
                "scale": g.scale,
                "critical_gain": g.edge.critical_gain,
                "frequency_hz": g.edge.frequency_hz,
                "at_least": g.edge.at_least,
                "verdict": g.at_asked.map(|o| Word::of(&o)),
            })).collect::<Vec<_>>()),
            "models": { "parts": self.checks, "loop": self.loop_check },
            "disagreement": self.disagreements,
            "warnings": self.warnings,
            "advice": self.advice,
            "held_back": self.held_back,
            "decided_by": self.decided_by,
            "witnesses": self.witnesses,
            "energy": { "recorded": self.recorded_energy_numbers() },
            "transparency": self.transparency_numbers(),
        })
    }

    fn recorded_energy_numbers(&self) -> Vec<Value> {
        let axes = self.recorded_energy.axes.iter();
        axes.map(|a| {
            json!({
                "axis": a.name,
                "verdict": a.verdict,
                "master_final_j": a.master.final_j,
                "master_minimum_j": a.master.minimum_j,
                "slave_final_j": a.slave.final_j,
                "slave_minimum_j": a.slave.minimum_j,
                "hold_power_w": a.master.hold.map(|t| t.mean_w),
                "elements": a.elements.iter().map(|e| json!({ "name": e.name, "kind": e.kind, "friction": e.friction, "taken_j": e.final_j })).collect::<Vec<_>>(),
                "bounds": a.bounds,
            })
        })
        .collect()
    }

    fn transparency_numbers(&self) -> Vec<Value> {
        let axes = self.transparency.iter();
        axes.map(|t| {
            json!({
                "axis": t.name,
                "impedance_error": t.impedance.as_ref().map(|i| i.error),
                "band_hz": t.impedance.as_ref().map(|i| i.band_hz),
                "position_free_rms": t.position_free_rms,
                "position_contact_rms": t.position_contact_rms,
                "force_contact_rms": t.force_contact_rms,
                "induced_ratio": t.induced_ratio,
                "cancellation": t.cancellation.as_ref().map(|c| json!({ "quality": c.quality, "correlation": c.correlation })),
                "notes": t.notes,
            })
        })
        .collect()
    }

    /// The energy method's word at the gain asked.
    pub fn energy_verdict(&self) -> EnergyVerdict {
        self.resimulated.as_ref().map_or(self.recorded_energy.verdict, |r| r.energy.verdict)
    }
}
