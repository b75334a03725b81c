//! The result of a search, in the form of the verdict file.

use crate::arms::base;
use crate::arms::coupled::is_coupled_by_many;
use crate::arms::error::ArmError;
use crate::arms::fit::Fit;
use crate::arms::inertial::{COUNT, NAMES};
use crate::arms::judge::{AGAINST, Judged};
use crate::arms::physics::{Physics, Term};
use crate::arms::place::place;
use crate::arms::regression::Data;
use crate::arms::remaining_residual::{Left, left};
use crate::arms::search::Search;
use crate::arms::sentences::{remaining, sentence};
use crate::arms::sure::{DOUBTED, beside, by_evidence, falls, may_be_nothing};
use crate::arms::weighing::{LEAST_SHARE, added, by_block};
use crate::arms::written::gravity_of;
use crate::belief::predictive::gain;
use crate::verdict::{
    ArmJoint, ArmPart, Estimate, Estimates, Finding, HeldOut, MODEL_FILE, Moved, NextExperiment, Parameter, RecordErrors, Remark, SCHEMA,
    Searched, Verdict, Word,
};
use std::collections::BTreeMap;

/// Everything that a verdict is made of.
pub struct Parts<'a> {
    /// Rows that count while the joints move.
    pub data: &'a Data<'a>,
    /// All rows.
    pub whole: &'a Data<'a>,
    /// What was found.
    pub search: &'a Search,
    /// What the logs say of themselves.
    pub audit: Vec<Remark>,
    /// Torque that a loop has to add, by the refitted nominal and by the diagnosed model.
    pub loops: [Option<Vec<f64>>; 2],
    /// The result of a simulation for each added term.
    pub judged: Vec<Option<Judged>>,
    /// What to record next.
    pub next: Option<NextExperiment>,
    /// Whether the search was interrupted.
    pub cut_short: bool,
}

/// The verdict.
///
/// # Errors
/// Where the robot cannot be computed.
pub fn verdict(parts: Parts) -> Result<Verdict, ArmError> {
    let Parts { data, whole, search, audit, loops, judged, next, cut_short } = parts;
    let findings = findings(data, search, &judged);
    let held = data.fit_count < data.motions.len();
    let moved = moved(data, search);
    let refit_helps =
        gain(&by_block(data, shown(&search.as_given), &search.weights, held), &by_block(data, shown(&search.refit), &search.weights, held))
            .is_some_and(|g| g.is_sure())
            && share_taken(data, &search.as_given, &search.refit, held) > LEAST_SHARE;
    let alike = findings.first().is_some_and(|f| f.confidence < 0.6);
    let left = left(data, &search.best);
    let word = match (findings.is_empty(), alike) {
        (false, true) => Word::Ambiguous,
        (false, false) => Word::Missing,
        (true, _) if cut_short || data.unsigned.contains(&true) => Word::CannotTell,
        (true, _) if left.iter().any(|l| l.shows.is_some()) => Word::Unexplained,
        (true, _) if refit_helps && !moved.is_empty() => Word::Parameters,
        (true, _) => Word::NothingMissing,
    };
    let residuals: Vec<Vec<f64>> = [&search.as_given, &search.refit, &search.best].map(|f| whole.residual_of(f)).to_vec();
    let arm = arm_part(data, whole, search, &residuals, &loops, left)?;
    let held_out = held_out(whole, &residuals);
    let unsigned: Vec<&str> =
        data.unsigned.iter().zip(&data.problem.joints).filter(|(is, _)| **is).map(|(_, name)| name.as_str()).collect();
    let mut sentence = sentence(word, &findings, &arm, held, &unsigned);
    if word != Word::NothingMissing && unsigned.is_empty() {
        sentence += &passive(data, &moved);
    }
    Ok(Verdict {
        schema: SCHEMA,
        word,
        sentence,
        shows: None,
        parameters: if word == Word::NothingMissing || !unsigned.is_empty() { BTreeMap::new() } else { moved },
        remaining: Some(remaining(&arm)),
        error_budget: Vec::new(),
        held_out,
        audit,
        unknown_inputs: Vec::new(),
        model_after: MODEL_FILE.to_string(),
        rival_models: Vec::new(),
        next_experiment: next,
        detectable: None,
        searched: cut_short.then_some(Searched { steps: 0, exhausted: false, cut_short }),
        arm: Some(Box::new(arm)),
        servo: None,
        findings,
    })
}

/// Of each joint without a motor the parameters that its equation has moved, in sentences.
fn passive(data: &Data, moved: &BTreeMap<String, Moved>) -> String {
    let of_joint = |j: usize| {
        let given = data.problem.given.iter().filter(|given| given.joint == j);
        let paths = given.flat_map(|given| {
            let prefix = format!("elements.{}.", given.name);
            moved.iter().filter(move |(path, _)| path.starts_with(&prefix))
        });
        let said: Vec<String> = paths
            .map(|(path, m)| format!("{} is {:.3e} (file: {:.3e})", path.trim_start_matches("elements."), m.value, m.nominal))
            .collect();
        let joint = &data.problem.joints[j];
        (!said.is_empty()).then(|| format!(" By the equation of {joint}, which has no motor, {}.", said.join(", ")))
    };
    (0..data.problem.joints.len()).filter(|j| data.is_passive(*j)).filter_map(of_joint).collect()
}

fn shown(fit: &Fit) -> &[f64] {
    &fit.residual
}

fn share_taken(data: &Data, base: &Fit, better: &Fit, held: bool) -> f64 {
    (0..data.problem.joints.len())
        .map(|j| 1.0 - data.mean_square(&better.residual, j, held) / data.mean_square(&base.residual, j, held).max(f64::MIN_POSITIVE))
        .fold(f64::NEG_INFINITY, f64::max)
}

fn estimate(value: f64, error: f64, unit: &str) -> Parameter {
    let ci95 = [Some(value - 1.96 * error), Some(value + 1.96 * error)];
    Parameter::One(Estimate { value, ci95, at_bound: false, unit: unit.to_string() })
}

/// The findings, those first whose absence would increase the error of held-out segments most, and last those that a simulation contradicts. Friction of one
/// level and its excess at a joint are one finding.
fn findings(data: &Data, search: &Search, judged: &[Option<Judged>]) -> Vec<Finding> {
    let best = &search.best;
    let indices = added(&best.structure);
    let mut out: Vec<(f64, Finding)> = Vec::new();
    for (order, index) in indices.iter().enumerate() {
        let term = &best.structure.terms[*index];
        let richer = [Physics::Stribeck, Physics::LoadFriction];
        let there = |physics: Physics| indices.iter().any(|i| best.structure.terms[*i].is_like(&Term::new(physics, term.at, Vec::new())));
        if term.physics == Physics::Coulomb && richer.iter().any(|p| there(*p)) {
            continue;
        }
        let local = search.local(term);
        let found = search.gains.get(order).copied().flatten();
        let (belief, alternatives) = match local {
            Some(local) => (local.belief, beside(data, local)),
            None => by_evidence(data, search, order, *index),
        };
        let (mut sure, mut kind) = (belief.law, belief.kind);
        let closed_loop = judged.get(order).and_then(|j| j.as_ref()).map(Judged::ratio);
        let numbers = numbers(data, best, *index);
        let against = closed_loop.is_some_and(|ratio| ratio > AGAINST);
        let is_doubted = !falls(data, search, term) || may_be_nothing(&numbers) || is_coupled_by_many(&best.structure, term);
        if against || is_doubted {
            (sure, kind) = (sure.min(DOUBTED), kind.min(DOUBTED));
        }
        let facts = term.physics.facts();
        let replaces = replaced(data, term);
        let finding = Finding {
            physics: facts.name.to_string(),
            place: place(data, term),
            parameters: numbers,
            replaces,
            confidence: sure,
            family: Some(facts.family),
            family_confidence: kind,
            alternatives,
            closed_loop,
        };
        out.push((if against || is_doubted { f64::NEG_INFINITY } else { found.map_or(0.0, |g| g.mean) }, finding));
    }
    out.sort_by(|a, b| b.0.total_cmp(&a.0));
    out.into_iter().map(|(_, f)| f).collect()
}

/// Elements of plain dry friction that a richer law takes the place of.
fn replaced(data: &Data, term: &Term) -> Vec<String> {
    if !matches!(term.physics, Physics::Stribeck | Physics::LoadFriction) {
        return Vec::new();
    }
    let plain = |law: &backdrive_plant::elements::Law| law.kind().name == "coulomb";
    data.problem.given.iter().filter(|g| Some(g.joint) == term.at.joint() && plain(&g.law)).map(|g| g.name.clone()).collect()
}

fn numbers(data: &Data, fit: &Fit, index: usize) -> BTreeMap<String, Parameter> {
    let term = &fit.structure.terms[index];
    let first = fit.places[index].start;
    let (value, error) = (fit.values[first], fit.errors[first]);
    let second = || (fit.values[first + 1], fit.errors[first + 1]);
    let joint = term.at.joint().unwrap_or(0);
    let turns = data.problem.tree.coordinates().get(joint).is_none_or(|c| c.kind == backdrive_plant::robot::JointKind::Revolute);
    let unit = |turning: &'static str, sliding: &'static str| if turns { turning } else { sliding };
    let force = unit("N m", "N");
    let shape = term.shape.first().copied().unwrap_or(f64::NAN);
    let other = |physics: Physics| {
        let at = fit.structure.terms.iter().position(|t| t.physics == physics && t.at == term.at)?;
        Some(fit.places[at].start)
    };
    let known = |value: f64, unit: &str| Parameter::One(Estimate { value, ci95: [None, None], at_bound: false, unit: unit.to_string() });
    let list = |pairs: Vec<(&str, Parameter)>| pairs.into_iter().map(|(k, v)| (k.to_string(), v)).collect();
    match term.physics {
        Physics::Damper => list(vec![("damping", estimate(value, error, unit("N m s/rad", "N s/m")))]),
        Physics::Coulomb | Physics::Bias | Physics::CoupledFriction => list(vec![("force", estimate(value, error, force))]),
        Physics::Stribeck => {
            let c = other(Physics::Coulomb);
            let level = c.map_or(0.0, |i| fit.values[i]);
            let at_rest = c.map_or(error, |i| fit.spread(&[(i, 1.0), (first, 1.0)]));
            list(vec![
                ("coulomb", estimate(level, c.map_or(0.0, |i| fit.errors[i]), force)),
                ("static", estimate(level + value, at_rest, force)),
                ("velocity", known(shape, unit("rad/s", "m/s"))),
            ])
        }
        Physics::LoadFriction => {
            let c = other(Physics::Coulomb);
            let level = c.map_or(known(0.0, force), |i| estimate(fit.values[i], fit.errors[i], force));
            list(vec![("force", level), ("coefficient", estimate(value, error, ""))])
        }
        Physics::Presliding => {
            list(vec![("coulomb", estimate(value, error, force)), ("stiffness", known(value / shape, unit("N m/rad", "N/m")))])
        }
        Physics::AsymmetricDamper => {
            let b = other(Physics::Damper);
            let level = b.map_or(0.0, |i| fit.values[i]);
            let of = |sign: f64| b.map_or(error, |i| fit.spread(&[(i, 1.0), (first, sign)]));
            let unit = unit("N m s/rad", "N s/m");
            list(vec![("positive", estimate(level + value, of(1.0), unit)), ("negative", estimate(level - value, of(-1.0), unit))])
        }
        Physics::QuadraticDrag => list(vec![("coefficient", estimate(value, error, unit("N m s²/rad²", "N s²/m²")))]),
        Physics::Spring => {
            let (b, of_b) = second();
            list(vec![
                ("stiffness", estimate(value, error, unit("N m/rad", "N/m"))),
                ("rest", estimate(-b / value, of_b / value.abs(), unit("rad", "m"))),
            ])
        }
        Physics::Cogging => {
            let (b, of_b) = second();
            let size = value.hypot(b).max(1e-300);
            let of_size = ((value * error).powi(2) + (b * of_b).powi(2)).sqrt() / size;
            list(vec![
                ("amplitude", estimate(size, of_size, force)),
                ("period", known(shape, unit("rad", "m"))),
                ("phase", estimate(b.atan2(value), of_size / size, "rad")),
            ])
        }
        Physics::Inertia => list(vec![("inertia", estimate(value, error, unit("kg m²", "kg")))]),
        Physics::Gain => list(vec![("gain", estimate(1.0 + value, error, ""))]),
        Physics::Offset => list(vec![("offset", estimate(value, error, unit("rad", "m")))]),
        Physics::Payload => list(vec![("mass", estimate(value, error, "kg"))]),
        Physics::Coupling => list(vec![("ratio", estimate(value, error, ""))]),
        // Number and shape say the same twice: by how much they differ is what being linear costs.
        Physics::Compliance => {
            let stiffness = 1.0 / value.max(f64::MIN_POSITIVE);
            let error = (error * stiffness * stiffness).hypot(stiffness - shape);
            list(vec![("stiffness", estimate(stiffness, error, unit("N m/rad", "N/m")))])
        }
        Physics::Backlash => list(vec![("gap", estimate(value, error.hypot(value - shape), unit("rad", "m")))]),
        Physics::Delay => list(vec![("delay", estimate(value, error, "s"))]),
        Physics::GravityDirection => {
            let (b, of_b) = second();
            let tilt = value.hypot(b).max(1e-300);
            let of_tilt = ((value * error).powi(2) + (b * of_b).powi(2)).sqrt() / tilt;
            let gravity = gravity_of(data, fit);
            let ci95 = vec![[None, None]; 3];
            let direction = Parameter::List(Estimates { value: gravity.iter().copied().collect(), ci95, unit: "m/s²".to_string() });
            list(vec![("tilt", estimate(tilt.atan(), of_tilt, "rad")), ("gravity", direction)])
        }
    }
}

/// Parameters of the nominal model that moved beyond their interval: elements, armatures, base parameters stay in the arm's own part.
fn moved(data: &Data, search: &Search) -> BTreeMap<String, Moved> {
    let best = &search.best;
    let mut out = BTreeMap::new();
    for (term, place) in best.structure.terms.iter().zip(&best.places) {
        let Some(given) = term.given else { continue };
        let (value, error) = (best.values[place.start], best.errors[place.start]);
        let (path, nominal) = match data.problem.given.get(given) {
            Some(element) => {
                let Some((key, nominal)) = key_of(term.physics, &element.law) else { continue };
                (format!("elements.{}.{key}", element.name), nominal)
            }
            None => {
                let joint = term.at.joint().unwrap_or(0);
                (format!("bodies.{}", data.problem.joints[joint]), data.problem.armature[joint])
            }
        };
        let sd = (value - nominal) / error.max(1e-300);
        if sd.abs() > 1.96 {
            let ci95 = [Some(value - 1.96 * error), Some(value + 1.96 * error)];
            out.insert(path, Moved { value, ci95, nominal, moved_sd: Some(sd) });
        }
    }
    if best.structure.tolerance > 0 {
        for (k, (found, nominal)) in data.parameters(best).iter().zip(&data.problem.bodies.nominal).enumerate() {
            for (i, name) in NAMES.iter().enumerate() {
                let along: Vec<(usize, f64)> = (0..COUNT).map(|b| (k * COUNT + b, data.problem.bodies.basis[k][(i, b)])).collect();
                let error = best.spread(&along);
                let sd = (found[i] - nominal[i]) / error.max(1e-300);
                if sd.abs() > 1.96 {
                    let ci95 = [Some(found[i] - 1.96 * error), Some(found[i] + 1.96 * error)];
                    let path = format!("robot.{}.{name}", data.problem.joints[k]);
                    out.insert(path, Moved { value: found[i], ci95, nominal: nominal[i], moved_sd: Some(sd) });
                }
            }
        }
    }
    out
}

/// The key of an element that a term's first number is, and what the file has there.
fn key_of(physics: Physics, law: &backdrive_plant::elements::Law) -> Option<(&'static str, f64)> {
    let key = match (physics, law.kind().name) {
        (Physics::Damper, "damper") => "damping",
        (Physics::Coulomb, "coulomb" | "load_friction") | (Physics::Bias, "bias") => "force",
        (Physics::Coulomb, "stribeck") => "coulomb",
        (Physics::LoadFriction, "load_friction") | (Physics::QuadraticDrag, _) => "coefficient",
        (Physics::Spring, "spring") => "stiffness",
        (Physics::Inertia, "inerter") => "inertance",
        (Physics::Presliding, "dahl") => "coulomb",
        _ => return None,
    };
    let at = law.kind().parameters.iter().position(|p| p.key == key)?;
    Some((key, law.values().get(at)?.first().copied()?))
}

fn arm_part(
    data: &Data,
    whole: &Data,
    search: &Search,
    residuals: &[Vec<f64>],
    loops: &[Option<Vec<f64>>; 2],
    left: Vec<Left>,
) -> Result<ArmPart, ArmError> {
    let held = whole.fit_count < whole.motions.len();
    let joints = left
        .into_iter()
        .enumerate()
        .map(|(j, left)| {
            let torque_rms = whole.scale(j, held);
            let share = |k: usize| (whole.mean_square(&residuals[k], j, held)).sqrt() / torque_rms.max(f64::MIN_POSITIVE);
            let of_loop = |k: usize| loops[k].as_ref().and_then(|l: &Vec<f64>| l.get(j).copied());
            ArmJoint {
                joint: data.problem.joints[j].clone(),
                torque_rms,
                as_given: share(0),
                refit: share(1),
                diagnosed: share(2),
                loop_refit: of_loop(0),
                loop_diagnosed: of_loop(1),
                moving: Some(left.share),
                noise: Some(left.noise),
                shows: left.shows,
            }
        })
        .collect();
    let base_parameters = base::of_fit(data, &search.best, &data.parameters(&search.best))?;
    Ok(ArmPart { corner_hz: data.rates.corner, joints, base_parameters })
}

fn held_out(whole: &Data, residuals: &[Vec<f64>]) -> HeldOut {
    let held = whole.fit_count < whole.motions.len();
    let motions = if held { whole.fit_count..whole.motions.len() } else { 0..whole.fit_count };
    let mut per_record = Vec::new();
    let mut pooled: Vec<BTreeMap<String, f64>> = vec![BTreeMap::new(); 3];
    for (j, joint) in whole.problem.joints.iter().enumerate() {
        let (mut errors, mut deviations) = ([0.0; 3], 0.0);
        for m in motions.clone() {
            let rows = whole.layout.of(m, j);
            let torque = &whole.torque[rows.clone()];
            let mean = torque.iter().sum::<f64>() / torque.len().max(1) as f64;
            let deviation: f64 = match whole.is_passive(j) {
                true => whole.scale(j, true).powi(2) * torque.len() as f64,
                false => torque.iter().map(|x| (x - mean).powi(2)).sum(),
            };
            let of = |k: usize| residuals[k][rows.clone()].iter().map(|x| x * x).sum::<f64>();
            let all = [of(0), of(1), of(2)];
            let share = |k: usize| Some((all[k] / deviation.max(f64::MIN_POSITIVE)).sqrt());
            per_record.push(RecordErrors {
                record: whole.motions[m].name.clone(),
                output: format!("{joint}.torque"),
                nrmse_before: share(0),
                nrmse_refit: share(1),
                nrmse_after: share(2),
                noise_floor: None,
            });
            errors.iter_mut().zip(all).for_each(|(e, a)| *e += a);
            deviations += deviation;
        }
        for (map, error) in pooled.iter_mut().zip(errors) {
            map.insert(format!("{joint}.torque"), (error / f64::max(deviations, f64::MIN_POSITIVE)).sqrt());
        }
    }
    let mean = |of: fn(&RecordErrors) -> Option<f64>| {
        let all: Vec<f64> = per_record.iter().filter_map(of).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    HeldOut {
        nrmse_before: mean(|r| r.nrmse_before),
        nrmse_refit: mean(|r| r.nrmse_refit),
        nrmse_after: mean(|r| r.nrmse_after),
        noise_floor: None,
        pooled_before: pooled.first().cloned(),
        pooled_refit: pooled.get(1).cloned(),
        pooled_after: pooled.get(2).cloned(),
        pooled_floor: None,
        per_record,
    }
}
