//! The answer from somebody else's recording, which holds no graph: from its signals alone.

use crate::answer::Answer;
use crate::cause::Cause;
use crate::cause_kind::CauseKind;
use crate::change::Change;
use crate::happening::Happening;
use crate::remedy::Remedy;
use backdrive_stability::by_itself::compared::{AsIf, Sensor, compare};
use backdrive_stability::coupling::Coupling;
use backdrive_stability::frequency;
use backdrive_stability::resimulate::Gain;
use backdrive_stability::resimulate::edge::Search;
use backdrive_stability::session::{AxisSignals, Session};
use backdrive_stability::verdict::{CoupledAxis, Question, Swapped, answer, is_coupled};
use std::sync::atomic::AtomicBool;

/// A lower gain is this share of the measured critical gain.
const BELOW: f64 = 0.8;

/// A delay is a suspect from this number of rows on; less is the one step that every sampled loop has.
const LEAST_LATE: usize = 3;

/// Answers for a session that was read by a roles file: what happens, how late and how large each way is, and the critical gain of the measured loop.
/// There is no re-simulation, because no model of the loop is known.
pub fn why_of_signals(session: &Session, gain: Gain) -> Answer {
    let (happening, coupled) = happening_of(session, gain);
    let (measured, mut notes) = measured(session, gain);
    let edge = measured.edge;
    // Of two coupled motors the law that moves each of them is known; of other recordings the two ways.
    let laws: Vec<(&str, &Coupling)> = coupled.iter().filter_map(|c| Some((c.axis.as_str(), c.coupling.as_ref()?))).collect();
    let mut causes: Vec<(Cause, f64)> = if laws.is_empty() {
        session.axes.iter().flat_map(|axis| of_axis(axis, session, gain, &happening)).collect()
    } else {
        notes.extend(laws.iter().map(|(axis, law)| format!("axis {axis}: {}", law.lines().join("; "))));
        laws.iter().flat_map(|(axis, law)| of_law(axis, law, session.period_s, &happening)).collect()
    };
    // The signal of a dead sensor is not in the loop; whether the loop needed it is not known.
    let dead = session.sensors.iter().map(|fault| (cause(CauseKind::DeadSensor, fault.signal.clone(), fault.to_string(), false), DEAD));
    causes.extend(dead);
    let differs = causes.iter().map(|(c, _)| c.evidence.clone()).collect();
    if let Some(edge) = edge.filter(|e| *e < gain.product()) {
        let evidence = format!("by the measured frequency response the loop is stable only up to mu*lambda = {edge:.3}");
        let holds = cause(CauseKind::GainTooHigh, String::new(), evidence, true);
        causes.push((Cause { without: format!("stable below {edge:.3}"), edge_without: Some(edge), ..holds }, 1.0));
    }
    notes.push("no loop was re-simulated: the recording contains no models".to_string());
    let remedies = match edge.filter(|_| happening.is_trouble()) {
        Some(edge) => vec![lower(gain, edge)],
        None => Vec::new(),
    };
    let sum: f64 = causes.iter().map(|(_, w)| w).sum::<f64>().max(0.2);
    let mut causes: Vec<Cause> = causes.into_iter().map(|(c, w)| Cause { confidence: SURE * w / sum, ..c }).collect();
    causes.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    if !happening.is_trouble() {
        causes.clear();
    }
    Answer {
        bag: session.name.clone(),
        gain: gain.product(),
        happens: happening.to_string(),
        happening,
        causes,
        beneath: None,
        remedies,
        differences: Vec::new(),
        differs,
        again: None,
        again_signals: None,
        reproduced: false,
        master: None,
        slave: None,
        edge,
        not_again: measured.why_not,
        events: Vec::new(),
        notes: session.notes.iter().cloned().chain(notes).collect(),
    }
}

/// A dead sensor that may be no part of the loop weighs so much.
const DEAD: f64 = 0.3;

/// What happens; for a pair of coupled motors the judgement while the hand moves, and the law of either motor.
fn happening_of(session: &Session, gain: Gain) -> (Happening, Vec<CoupledAxis>) {
    let judged = is_coupled(session).then(|| {
        let question = Question {
            session,
            recorded: None,
            asked: None,
            swapped: Swapped::default(),
            intents: None,
            script: None,
            gain,
            grips: Vec::new(),
            search: Search::default(),
        };
        let answer = answer(&question, &|_, _, _| {}, &AtomicBool::new(false)).ok()?;
        Some((answer.recorded_outcome?, answer.coupled))
    });
    match judged.flatten() {
        Some((outcome, coupled)) => (Happening::of_outcome(outcome, &[]), coupled),
        None => (Happening::of(session, session.len()), Vec::new()),
    }
}

/// What the recovered laws of two motors say: a sign that pushes them apart, a delay, a slow filter of speeds, a clamp.
fn of_law(axis: &str, law: &Coupling, period_s: f64, happening: &Happening) -> Vec<(Cause, f64)> {
    let mut all = Vec::new();
    for (side, name) in [(&law.master, "master"), (&law.slave, "slave")] {
        let at = |kind: CauseKind, text: String| cause(kind, format!("axis {axis}, {name}"), text, false);
        if side.pushes_apart() {
            all.push((at(CauseKind::WrongSign, format!("the {name}'s motor pushes the two sides apart: a sign is wrong")), 6.0));
        }
        // Of half a period of what oscillates, which is what it takes to turn a loop round.
        let share = |late_s: f64| happening.frequency_hz().map_or(0.5, |hz| (2.0 * hz * late_s).min(3.0));
        let delays = [(side.delay_s, "the positions"), (side.force_delay_s, "the measured forces")];
        for (late, of) in delays.iter().filter_map(|(delay, of)| Some((delay.as_ref()?, of))) {
            // One step is what every sampled loop has.
            if late.ci95[0] > LEAST_LATE as f64 * period_s {
                let [low, high] = late.ci95.map(|s| 1e3 * s);
                let text = format!("the {name}'s motor uses {of} {:.1} ms late (95 %: {low:.1} to {high:.1} ms)", 1e3 * late.value);
                all.push((at(CauseKind::Delay, text), share(late.value)));
            }
        }
        if let Some(filter) = side.filter_s.as_ref().filter(|f| f.ci95[0] > LEAST_LATE as f64 * period_s) {
            let corner = 1.0 / (std::f64::consts::TAU * filter.value);
            let text = format!("the {name}'s law filters speeds at {corner:.1} Hz, which is a lag of {:.1} ms", 1e3 * filter.value);
            all.push((at(CauseKind::FilterLag, text), 0.5 * share(filter.value)));
        }
        if let (Some(limit), Happening::Saturation { .. }) = (side.limit, happening) {
            all.push((at(CauseKind::Saturation, format!("the {name}'s motor is clamped at {limit:.3}")), 2.0));
        }
    }
    all
}

/// A result without a re-simulation is not certain.
const SURE: f64 = 0.7;

/// The stability limit of the measured loop.
struct Measured {
    edge: Option<f64>,
    why_not: Option<String>,
}

fn measured(session: &Session, gain: Gain) -> (Measured, Vec<String>) {
    match frequency::analyse(session, &frequency::Options::default()) {
        Ok(found) => {
            let at = found.at(gain.product());
            let why_not = at.critical_gain.is_none().then(|| at.reason.clone());
            let advice = at.advice.clone().map(|a| format!("to record for a better answer: {a}"));
            (Measured { edge: at.critical_gain, why_not }, advice.into_iter().collect())
        }
        Err(e) => (Measured { edge: None, why_not: Some(e.to_string()) }, Vec::new()),
    }
}

fn cause(kind: CauseKind, place: String, evidence: String, holds_without: bool) -> Cause {
    let without = "not re-simulated: no model of the loop is known".to_string();
    Cause {
        kind,
        place,
        evidence,
        without,
        holds_without,
        edge_without: None,
        share: None,
        seen: true,
        confidence: 0.0,
        repairs: Vec::new(),
    }
}

/// What an axis' signals say of its two ways: from the master's position to the command, and from the contact force to the master.
fn of_axis(axis: &AxisSignals, session: &Session, gain: Gain, happening: &Happening) -> Vec<(Cause, f64)> {
    let induced = |row: usize| axis.induced.as_ref().and_then(|i| i.get(row)).copied().filter(|x| x.is_finite()).unwrap_or(0.0);
    let dither = |row: usize| axis.dither.as_ref().and_then(|d| d.get(row)).copied().filter(|x| x.is_finite()).unwrap_or(0.0);
    let wanted: Vec<f64> = (0..axis.master.len()).map(|r| gain.mu * (axis.master[r] - induced(r))).collect();
    let reflected: Vec<f64> = (0..axis.force.len()).map(|r| axis.force[r] - dither(r)).collect();
    let felt: Vec<f64> = axis.contact.iter().map(|f| gain.lambda * f).collect();
    let sensor = Sensor { resolution: axis.resolution, noise: axis.noise, ..Sensor::default() };
    let ways = [
        ("the command x_c", "mu times the master's position", &axis.command, &wanted, sensor),
        ("the force F_f on the master", "lambda times the contact force", &reflected, &felt, Sensor::default()),
    ];
    let mut all = Vec::new();
    for (what, of, recorded, predicted, sensor) in ways {
        let Some(found) = compare(recorded, predicted, &sensor, session.period_s) else { continue };
        let at = |kind: CauseKind, text: String| cause(kind, format!("axis {}", axis.name), text, false);
        match found.as_if {
            AsIf::Changed { gain, .. } if gain < 0.0 => {
                all.push((at(CauseKind::WrongSign, format!("{what} has the opposite sign of {of}: it is {gain:.2} times that")), 6.0));
            }
            AsIf::Changed { late, .. } if late >= LEAST_LATE => {
                let late_s = late as f64 * session.period_s;
                // Of half a period of what oscillates, which is what it takes to turn a loop round.
                let share = happening.frequency_hz().map_or(0.5, |hz| (2.0 * hz * late_s).min(3.0));
                all.push((at(CauseKind::Delay, format!("{what} lags {of} by {:.1} ms", 1e3 * late_s)), share));
            }
            AsIf::Dead { from_row } => {
                let text = format!("{what} is constant from {:.2} s on, while {of} moves", from_row as f64 * session.period_s);
                all.push((at(CauseKind::DeadSensor, text), 6.0));
            }
            AsIf::Railed { .. } => all.push((at(CauseKind::Saturation, format!("{what} saturates, while {of} moves on")), 2.0)),
            AsIf::Held { rows, .. } => {
                let (hz, loop_hz) = (1.0 / (rows * session.period_s), 1.0 / session.period_s);
                let text = format!("{what} is renewed at {hz:.1} Hz only, and {of} at {loop_hz:.0} Hz");
                // Held values are half a renewal late on average.
                let share = happening.frequency_hz().map_or(0.5, |f| (f / hz).min(3.0));
                all.push((at(CauseKind::Rate, text), share));
            }
            AsIf::Filtered { corner_hz, .. } => {
                let text = format!("{what} is {of} behind a low-pass of {corner_hz:.1} Hz");
                // Its lag is an eighth of a period at the corner.
                let share = happening.frequency_hz().map_or(0.5, |f| (f / corner_hz).min(3.0));
                all.push((at(CauseKind::FilterLag, text), share));
            }
            AsIf::Unsteady { .. } | AsIf::Changed { .. } | AsIf::Stepped { .. } | AsIf::Noisy { .. } | AsIf::Same | AsIf::Otherwise => {}
        }
    }
    all
}

/// The one remedy that needs no model.
fn lower(gain: Gain, edge: f64) -> Remedy {
    let factor = (BELOW * edge / gain.product()).min(1.0);
    let change = Change::Gain { factor, lambda: factor * gain.lambda };
    Remedy {
        text: change.to_string(),
        changes: vec![change],
        outcome: format!("stable by the measured frequency response, 20 % below its stability limit of {edge:.3}"),
        stops: true,
        robust: false,
        force_kept: factor,
        motion_kept: 1.0,
        throws: None,
        repairs_cause: false,
        options: None,
        signals: None,
    }
}
