//! One call from commands and positions to a verdict and a model.

use crate::error::ServoError;
use crate::fit::substeps;
use crate::inputs::{Use, looked_at};
use crate::physics::named;
use crate::problem::{Joint, Problem};
use crate::record::Record;
use crate::run::free_runs;
use crate::search::{Candidate, Claim, Found as JointSearch, scored, search_all};
use crate::shared::shared;
use crate::simulate::simulate;
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::recordings::noise;
use backdrive_diagnosis::verdict::{
    Alternative, Estimate, Finding, HeldOut, MODEL_FILE, Parameter, RecordErrors, Remark, SCHEMA, Searched, ServoAnswer, ServoErrors,
    ServoPart, Verdict, Word,
};
use backdrive_plant::model::Model;
use backdrive_plant::servo::{Number, Numbers, ServoJoint};
use backdrive_signal::statistics::median;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

/// What was found of one joint.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The joint, by its place in the problem.
    pub joint: usize,
    /// The search.
    pub found: JointSearch,
    /// Errors of every judged record: its name, and of the command, the base and the diagnosed joint the nrmse and the mean absolute error.
    pub judged: Vec<Judged>,
    /// Whether those are held-out records.
    pub is_held_out: bool,
}

/// Errors of one record.
#[derive(Debug, Clone)]
pub struct Judged {
    /// The record.
    pub record: Record,
    /// Free run with delay, second order and offset.
    pub refit: Vec<f64>,
    /// Free run of the diagnosed joint.
    pub diagnosed: Vec<f64>,
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// The verdict.
    pub verdict: Verdict,
    /// The model with its servos.
    pub model: Model,
    /// Each joint that could be diagnosed.
    pub answers: Vec<Answer>,
    /// What a reader should know besides.
    pub notes: Vec<String>,
}

/// A joint that hardly moves in a record, rad or m: its nrmse there is not used.
const MOVES: f64 = 1e-3;

/// What a rival that does nearly the same keeps beside the claim, however well the claim predicts: laws that simplify the same drive differ in what was left out of both.
const DOUBT: f64 = 0.15;

/// Diagnoses every joint. Once `stop` is set, or the patience that was asked for ends, the search ends with what was found until then, and the verdict
/// states this; `report` hears what is being done.
///
/// # Errors
/// Where commands are none, or no joint can be used.
pub fn diagnose(
    problem: &Problem,
    options: &Options,
    stop: Option<&AtomicBool>,
    report: &(dyn Fn(&str) + Sync),
) -> Result<Found, ServoError> {
    let limit = options.limit_as_asked(stop);
    report("looking at the commands");
    let mut remarks = Vec::new();
    let mut used = Vec::new();
    for (index, joint) in problem.joints.iter().enumerate() {
        match looked_at(joint)? {
            Use::Good => used.push(index),
            Use::Still(why) => remarks.push(Remark {
                what: "constant".to_string(),
                place: joint.name.clone(),
                message: format!("it is not diagnosed: {why}"),
                weight: Weight::Caution,
            }),
        }
    }
    if used.is_empty() {
        let first = remarks.first().map_or("the set names no joint with a command and a position".to_string(), |r| r.message.clone());
        let at = problem.joints.first().map_or("set".to_string(), |j| j.name.clone());
        return Err(ServoError::wrong(at, first));
    }
    if problem.joints.iter().all(|j| j.fit.is_empty()) {
        return Err(ServoError::wrong("set.toml: fit", "names no recording: name some under fit"));
    }
    let records: Vec<(Vec<&Record>, f64)> = used
        .iter()
        .map(|index| {
            let records: Vec<&Record> = problem.joints[*index].fit.iter().filter(|r| r.t.len() > 20).collect();
            let floor = floor(&records);
            (records, floor)
        })
        .collect();
    report("diagnosing the servo joints");
    let found = search_all(&records, options, limit);
    let cut_short = limit.is_over();
    report("simulating from the commands");
    let answers: Vec<Answer> = used.iter().zip(found).map(|(index, found)| answer(*index, &problem.joints[*index], found)).collect();
    let answers = from_commands_alone(problem, answers)?;
    let mut model = problem.model.clone();
    for answer in &answers {
        let joint = &problem.joints[answer.joint];
        let servo = ServoJoint { joint: joint.name.clone(), numbers: rounded(&answer.found.best) };
        model.servos.retain(|s| s.joint != servo.joint);
        model.servos.push(servo);
    }
    let verdict = verdict(problem, &answers, remarks, cut_short);
    let mut notes = problem.notes.clone();
    if cut_short {
        let by = if limit.was_stopped() { "interrupted" } else { "cut off by the clock (--patience)" };
        notes.push(format!("the search was {by}: what else is missing was not looked for to the end"));
    }
    Ok(Found { verdict, model, answers, notes })
}

/// Parameters of a fit as a file has them: seven digits.
fn rounded(candidate: &Candidate) -> Numbers {
    let mut numbers = candidate.fit.numbers;
    for n in &candidate.fit.free {
        numbers[*n] = backdrive_plant::write::round_significant(numbers[*n], 7);
    }
    numbers
}

fn answer(index: usize, joint: &Joint, found: JointSearch) -> Answer {
    let records: Vec<&Record> = joint.fit.iter().filter(|r| r.t.len() > 20).collect();
    let is_held_out = !joint.held_out.is_empty();
    let judged = if is_held_out {
        let of = |r: &Record, n: &Numbers| simulate(n, r, substeps(r));
        let each =
            |r: &Record| Judged { record: r.clone(), refit: of(r, &found.base.fit.numbers), diagnosed: of(r, &found.best.fit.numbers) };
        joint.held_out.iter().map(each).collect()
    } else {
        let each = |(i, r): (usize, &&Record)| {
            let of = |c: &Candidate| simulate(c.folds.get(found.folds[i]).unwrap_or(&c.fit.numbers), r, substeps(r));
            Judged { record: (*r).clone(), refit: of(&found.base), diagnosed: of(&found.best) }
        };
        records.iter().enumerate().map(each).collect()
    };
    Answer { joint: index, found, judged, is_held_out }
}

/// Re-simulation of held-out recordings with all joints where their own free runs bring them, not where they were recorded.
fn from_commands_alone(problem: &Problem, mut answers: Vec<Answer>) -> Result<Vec<Answer>, ServoError> {
    let numbers = |of: &dyn Fn(&JointSearch) -> Numbers| -> Vec<Option<Numbers>> {
        (0..problem.joints.len()).map(|j| answers.iter().find(|a| a.joint == j).map(|a| of(&a.found))).collect()
    };
    let best = numbers(&|found| found.best.fit.numbers);
    let count = problem.joints.first().map_or(0, |j| j.held_out.len());
    for index in 0..count {
        let positions = free_runs(problem, &best, true, index)?;
        for answer in &mut answers {
            if let Some(judged) = answer.judged.get_mut(index) {
                judged.diagnosed.clone_from(&positions[answer.joint]);
            }
        }
    }
    Ok(answers)
}

/// What the position sensor resolves: its step, or its noise.
pub(crate) fn floor(records: &[&Record]) -> f64 {
    let of = |r: &Record| {
        let mut steps: Vec<f64> = r.position.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 1e-12).collect();
        steps.sort_by(f64::total_cmp);
        let step = steps.get(steps.len() / 10).copied().unwrap_or(0.0);
        (0.3 * step).max(noise::white(&r.position).filter(|x| x.is_finite()).unwrap_or(0.0))
    };
    let mut all: Vec<f64> = records.iter().map(|r| of(r)).filter(|x| *x > 0.0).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(1e-6)
}

fn verdict(problem: &Problem, answers: &[Answer], audit: Vec<Remark>, cut_short: bool) -> Verdict {
    let mut findings = Vec::new();
    let mut joints = Vec::new();
    let mut per_record = Vec::new();
    for answer in answers {
        let joint = &problem.joints[answer.joint];
        let gain = gain_of(joint, &answer.found);
        for claim in &answer.found.claims {
            findings.push((worth(claim), finding(joint, &answer.found, claim, gain.as_ref())));
        }
        joints.push(ServoAnswer {
            joint: joint.name.clone(),
            errors: errors(answer),
            numbers: numbers_of(&answer.found.best),
            gain,
            shared: shared(&answer.found),
        });
        for judged in answer.judged.iter().filter(|j| moves(&j.record)) {
            let of = |simulated: &[f64]| Some(scored(simulated, &judged.record.position).0);
            per_record.push(RecordErrors {
                record: judged.record.name.clone(),
                output: format!("{}.position", joint.name),
                nrmse_before: of(&judged.record.command),
                nrmse_refit: of(&judged.refit),
                nrmse_after: of(&judged.diagnosed),
                noise_floor: None,
            });
        }
    }
    findings.sort_by(|a, b| b.0.total_cmp(&a.0));
    let findings: Vec<Finding> = findings.into_iter().map(|(_, f)| f).collect();
    let mean = |of: &dyn Fn(&RecordErrors) -> Option<f64>| {
        let all: Vec<f64> = per_record.iter().filter_map(of).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    let held_out = HeldOut {
        nrmse_before: mean(&|r| r.nrmse_before),
        nrmse_refit: mean(&|r| r.nrmse_refit),
        nrmse_after: mean(&|r| r.nrmse_after),
        per_record: per_record.clone(),
        ..HeldOut::default()
    };
    let poor = joints.iter().any(|j| j.errors.diagnosed.is_some_and(|e| e > 0.5));
    let word = match findings.first() {
        Some(first) if first.confidence < 0.6 => Word::Ambiguous,
        Some(_) => Word::Missing,
        None if cut_short => Word::CannotTell,
        None if poor => Word::Unexplained,
        None => Word::NothingMissing,
    };
    let servo = ServoPart { scale: scale(problem, answers), joints };
    Verdict {
        schema: SCHEMA,
        word,
        sentence: crate::sentences::sentence(word, &findings, &servo),
        findings,
        shows: None,
        parameters: BTreeMap::new(),
        remaining: None,
        error_budget: Vec::new(),
        held_out,
        audit,
        unknown_inputs: Vec::new(),
        model_after: MODEL_FILE.to_string(),
        rival_models: Vec::new(),
        next_experiment: None,
        detectable: None,
        searched: cut_short.then_some(Searched { steps: 0, exhausted: false, cut_short }),
        arm: None,
        servo: Some(Box::new(servo)),
    }
}

fn moves(record: &Record) -> bool {
    backdrive_signal::statistics::deviation(&record.position) > MOVES
}

fn worth(claim: &Claim) -> f64 {
    claim.without.map_or(0.0, |g| g.mean)
}

/// Median of the nrmse over the records in which the joint moves, and mean of the mean absolute errors over all.
fn errors(answer: &Answer) -> ServoErrors {
    let of = |simulated: &dyn Fn(&Judged) -> Vec<f64>| {
        let mut shares = Vec::new();
        let mut absolute = 0.0;
        for judged in &answer.judged {
            let (share, mae) = scored(&simulated(judged), &judged.record.position);
            absolute += mae / answer.judged.len().max(1) as f64;
            if moves(&judged.record) {
                shares.push(share);
            }
        }
        (median(shares), absolute)
    };
    let (command, command_mae) = of(&|j| j.record.command.clone());
    let (refit, refit_mae) = of(&|j| j.refit.clone());
    let (diagnosed, diagnosed_mae) = of(&|j| j.diagnosed.clone());
    ServoErrors { command, refit, diagnosed, command_mae, refit_mae, diagnosed_mae }
}

/// A number with its interval: the jackknife over the folds (Tukey), by Student's t.
fn estimate(candidate: &Candidate, of: &dyn Fn(&Numbers) -> f64, unit: &str) -> Estimate {
    let value = of(&candidate.fit.numbers);
    let all: Vec<f64> = candidate.folds.iter().map(of).collect();
    let k = all.len() as f64;
    let mean = all.iter().sum::<f64>() / k.max(1.0);
    let variance = (k - 1.0) / k * all.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    let t = StudentsT::new(0.0, 1.0, (k - 1.0).max(1.0)).map_or(2.0, |t| t.inverse_cdf(0.975));
    let half = t * variance.sqrt();
    let interval = if half.is_finite() && k > 1.0 { [Some(value - half), Some(value + half)] } else { [None, None] };
    Estimate { value, ci95: interval, at_bound: false, unit: unit.to_string() }
}

fn of_number(candidate: &Candidate, n: Number) -> Estimate {
    let facts = n.facts();
    let mut out = estimate(candidate, &|numbers| numbers[n], facts.unit);
    let [least, most] = facts.range;
    out.ci95 = out.ci95.map(|x| x.map(|x| x.clamp(least, most)));
    out.at_bound = out.value <= least || out.value >= most;
    out
}

pub(crate) fn numbers_of(candidate: &Candidate) -> BTreeMap<String, Estimate> {
    candidate.fit.free.iter().map(|n| (n.facts().key.to_string(), of_number(candidate, *n))).collect()
}

/// The proportional gain, where gravity with known masses determines it.
fn gain_of(joint: &Joint, found: &JointSearch) -> Option<Estimate> {
    let best = &found.best;
    if !joint.is_weighed || !best.added.contains(&"gravity") || best.added.contains(&"gain") || best.added.contains(&"payload") {
        return None;
    }
    let gravity = of_number(best, Number::Gravity);
    let [Some(low), Some(high)] = gravity.ci95 else { return None };
    // Where the sign itself is open, nothing is known.
    (low > 0.0).then(|| Estimate {
        value: 1.0 / gravity.value,
        ci95: [Some(1.0 / high), Some(1.0 / low)],
        at_bound: false,
        unit: "N m/rad".to_string(),
    })
}

fn scale(problem: &Problem, answers: &[Answer]) -> String {
    let known: Vec<&str> = answers
        .iter()
        .filter(|a| gain_of(&problem.joints[a.joint], &a.found).is_some())
        .map(|a| problem.joints[a.joint].name.as_str())
        .collect();
    match known.is_empty() {
        true => "no torque scale is known: forces are given as angles, divided by the servo's proportional gain (rad); a stated gain or a \
            known payload would give N m"
            .to_string(),
        false => format!(
            "torques in N m are scaled by the masses of the robot file and the droop at {}, and are as accurate as those masses. Other \
             forces are angles, divided by the proportional gain (rad)",
            known.join(", ")
        ),
    }
}

/// Where an effect acts.
pub fn place(joint: &str, physics: &str) -> Place {
    match physics {
        "dead_band" | "gain" | "saturation" | "speed_limit" | "acceleration_limit" | "integral" | "lead" => {
            Place::Signal(format!("{joint}.command"))
        }
        _ => Place::Between(joint.to_string(), "ground".to_string()),
    }
}

fn finding(joint: &Joint, found: &JointSearch, claim: &Claim, gain: Option<&Estimate>) -> Finding {
    let normal = Normal::standard();
    let sure = |z: f64| normal.cdf(z.clamp(-8.0, 8.0));
    // What is as good in its place takes its share.
    let rivals: Vec<(&str, f64)> = claim
        .rivals
        .iter()
        .map(|(name, gain)| {
            let own = gain.map_or(0.5, |g| sure(g.in_errors()));
            (*name, ((1.0 - own) / own.max(1e-9)).clamp(DOUBT, 1.0))
        })
        .collect();
    // Where no rival has a name, one without a name keeps the doubt.
    let all = 1.0 + rivals.iter().map(|r| r.1).sum::<f64>().max(DOUBT);
    let there = claim.without.map_or(0.5, |g| sure(g.in_errors()).max(if g.is_sure() { 0.95 } else { 0.0 }));
    let mut parameters = BTreeMap::new();
    for n in named(claim.name).iter().flat_map(|p| p.numbers) {
        let estimate = of_number(&found.best, *n);
        if let (Some(gain), "rad") = (gain, n.facts().unit) {
            let force = Estimate { value: estimate.value * gain.value, ci95: [None, None], at_bound: false, unit: "N m".to_string() };
            parameters.insert(format!("{}_torque", n.facts().key), Parameter::One(force));
        }
        parameters.insert(n.facts().key.to_string(), Parameter::One(estimate));
    }
    let mut alternatives: Vec<Alternative> = rivals
        .iter()
        .filter(|r| r.1 / all * there > 0.01)
        .map(|(name, weight)| Alternative {
            physics: (*name).to_string(),
            place: place(&joint.name, name),
            confidence: there * weight / all,
        })
        .collect();
    alternatives.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    Finding {
        physics: claim.name.to_string(),
        place: place(&joint.name, claim.name),
        parameters,
        replaces: Vec::new(),
        confidence: there / all,
        family: None,
        family_confidence: there,
        alternatives,
        closed_loop: None,
    }
}
