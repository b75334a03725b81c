//! The answer for a recording with the forces of both motors: what the pair did at its own gains, and which law couples it.

use super::question::Question;
use super::recorded::{is_pair, recorded_traces};
use super::types::{Answer, CoupledAxis};
use super::warn::of_what_was_read;
use super::warning::Warning;
use super::word::{Method, Word};
use crate::coupling::{Signals, identify};
use crate::energy::energy;
use crate::judgement::judge_with_decay;
use crate::outcome::{Outcome, Trace};
use crate::session::Session;
use crate::transparency::transparency;

/// More of the rows than this at the clamp of a motor, and the clamp decides, as in `outcome`.
const MOST_CLAMPED: f64 = 0.01;

/// Whether the forces of both motors of an axis were recorded.
pub fn is_coupled(session: &Session) -> bool {
    session.axes.iter().any(is_pair)
}

impl Answer {
    /// What a coupled pair did.
    pub(super) fn of_coupled(question: &Question) -> Answer {
        let session = question.session;
        let coupled: Vec<CoupledAxis> = (0..session.axes.len()).filter_map(|index| axis(session, index)).collect();
        let outcome = Outcome::worst(coupled.iter().map(|c| c.outcome));
        let held_back = match outcome {
            Some(Outcome::NotJudged { why }) => Some(why),
            _ => None,
        };
        let mut warnings = of_what_was_read(session);
        for coupling in coupled.iter().filter_map(|c| c.coupling.as_ref()) {
            let sides = [(&coupling.master, "F_f", "x_m"), (&coupling.slave, "tau_s", "x_s")];
            warnings.extend(sides.iter().filter(|(side, ..)| side.pushes_apart()).map(|(_, force, position)| {
                Warning::Recording(format!(
                    "{force} pushes the two sides apart: is its sign, or that of {position}, wrong? Correct it with scale = -1 in the \
                        roles file"
                ))
            }));
        }
        let verdict = outcome.as_ref().map_or(Word::CannotTell, Word::of);
        Answer {
            bag: session.name.clone(),
            gain: question.gain,
            recorded_gain: None,
            verdict,
            reason: reason(&coupled, outcome),
            from: if verdict == Word::CannotTell { Method::Nothing } else { Method::Recording },
            critical_gain: None,
            at_least: None,
            limited_from: None,
            critical_gain_ci95: None,
            critical_frequency_hz: None,
            margins: None,
            frequency_answer: None,
            frequency: None,
            resimulated: None,
            no_resimulation: Some("the recording does not contain the models of the two devices".to_owned()),
            recorded_outcome: outcome,
            recorded_energy: energy(session, question.recorded, None),
            transparency: transparency(session, question.recorded),
            checks: Vec::new(),
            loop_check: None,
            disagreements: Vec::new(),
            warnings,
            advice: held_back.map(|why| why.advice().to_owned()),
            held_back,
            witnesses: Vec::new(),
            decided_by: None,
            coupled,
            loops: None,
            sensors: session.sensors.clone(),
        }
    }
}

fn axis(session: &Session, index: usize) -> Option<CoupledAxis> {
    let signals = Signals::of(session, index)?;
    let axis = session.axes.get(index)?;
    let found = identify(&signals);
    let trace = recorded_traces(session).into_iter().nth(index)?;
    let (outcome, slowest_mode) = judge_with_decay(&Trace { mu: signals.mu, ..trace });
    let share =
        |force: &[f64], limit: f64| force.iter().filter(|f| f.abs() >= limit * (1.0 - 1e-6)).count() as f64 / force.len().max(1) as f64;
    let sides = found.as_ref().ok().map(|c| [(signals.master_force, c.master.limit), (signals.slave_force, c.slave.limit)]);
    let clamped_share = sides.iter().flatten().filter_map(|(f, limit)| Some(share(f, (*limit)?))).fold(0.0, f64::max);
    let limited = outcome == Outcome::Stable && clamped_share > MOST_CLAMPED;
    let outcome = if limited { Outcome::Limited { clamped_share, beyond_travel: false } } else { outcome };
    let finite = axis.contact.iter().filter(|f| f.is_finite());
    Some(CoupledAxis {
        axis: axis.name.clone(),
        why_not: found.as_ref().err().map(ToString::to_string),
        coupling: found.ok(),
        slowest_mode,
        outcome: outcome.held_back(session.cut_short),
        largest_contact: finite.fold(0.0, |m, f| m.max(f.abs())),
    })
}

fn reason(coupled: &[CoupledAxis], outcome: Option<Outcome>) -> String {
    let Some(outcome) = outcome else { return "no axis has both positions and both motors' forces".to_owned() };
    let Some(axis) = coupled.iter().find(|c| c.outcome == outcome) else { return outcome.to_string() };
    let touched = format!("F_s was at most {:.3}; this answer does not cover stiffer contact", axis.largest_contact);
    let mode = axis.slowest_mode.map(|m| {
        let what = if m.of_error { "the difference of the positions" } else { "the master" };
        format!(
            "the least damped oscillation, {:.1} Hz in {what}, decays by {:.0} per second (95 %: {:.0} to {:.0})",
            m.frequency_hz, m.per_s, m.ci95[0], m.ci95[1]
        )
    });
    match (outcome, mode) {
        (Outcome::Stable, Some(mode)) => format!("in the recording, at its own gains, while the hand moves: {mode}; {touched}"),
        (Outcome::Stable, None) => format!("in the recording, at its own gains, no oscillation while the hand moves; {touched}"),
        (outcome, Some(mode)) => format!("in the recording, at its own gains: {outcome}; {mode}"),
        (outcome, None) => format!("in the recording, at its own gains: {outcome}"),
    }
}
