//! What a search says: the verdict file, and the nominal model's file with what was found.

use crate::clock::Moment;
use crate::compare::nrmse;
use crate::experiment::{excite, separate};
use crate::fit::Evaluator;
use crate::hypothesis::{Hypothesis, PHYSICS, Place, apply_edits, physics_named, withheld};
use crate::intervals::Spread;
use crate::numbers::stated_edits;
use crate::problem::Problem;
use crate::search::{AT_FLOOR, Candidate, Search, advantage_over};
use crate::statistics::advantage;
use crate::structure::{Number, Role, Structure};
use crate::unknown::{Estimated, Unknown, estimated};
use backdrive_plant::write::{patch, round_significant};
use serde_json::{Value as Json, json};
use std::collections::HashSet;
use std::time::Duration;

/// A verdict, ready to be written.
#[derive(Debug)]
pub struct Verdict {
    /// The verdict file.
    pub json: Json,
    /// The model file with what was found.
    pub model: String,
    /// Models of other explanations that leave over little more, the nearest first: what is built on the verdict has to stand with these too.
    pub rivals: Vec<String>,
    /// In one sentence.
    pub sentence: String,
    /// The excitation file of the next experiment, to be written as [`EXPERIMENT_FILE`]; `None` where none is needed or can be had.
    pub experiment: Option<String>,
}

/// Name of the file of the next experiment.
pub const EXPERIMENT_FILE: &str = "next-experiment.toml";
/// Name of the file of a rival's model, from 1.
pub fn rival_file(number: usize) -> String {
    format!("model.rival-{number}.toml")
}

/// Rivals whose models are written, at most.
const RIVALS: usize = 3;
/// What a rival leaves over, in squares of what the claimed explanation does, at most.
const NEARLY: f64 = 2.0;

/// How long the next experiment is looked for.
const EXPERIMENT: Duration = Duration::from_secs(2);

/// Why a verdict cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum VerdictError {
    /// The model's text cannot be edited.
    #[error(transparent)]
    Patch(#[from] backdrive_plant::write::PatchError),
    /// Refitted numbers cannot be put into the model.
    #[error("the refitted numbers do not fit into the model: {0}")]
    Refitted(String),
    /// A physics that was found cannot be put into the model.
    #[error(transparent)]
    Hypothesis(#[from] crate::hypothesis::HypothesisError),
}

/// Improvements below this advantage (difference of information criteria) are not claimed.
const LEAST_ADVANTAGE: f64 = 30.0;
/// Nor those that take less than this share of the cost.
const LEAST_SHARE: f64 = 0.02;
/// Structures of an advantage below this over a simpler one are ties, which the simpler one wins.
const TIE: f64 = 8.0;
/// Explanations of an advantage below this over each other cannot be told apart.
const ALIKE: f64 = 6.0;
/// Level and correlation time (samples) up to which what is left over is measuring error beyond doubt.
const NOISE_LEVEL: f64 = 1.05;
/// See [`NOISE_LEVEL`].
const NOISE_MEMORY: f64 = 1.2;
/// Distance from white noise, standard deviations of chance, beyond which something is left over however small it is: fits of the right structure
/// stay below 3, and 2 or 3 times that where they stop before their end.
const WANDERS: f64 = 12.0;
/// Level above which what is left over is no measuring error.
const LEFT_OVER: f64 = 1.15;

/// Which of the structures is claimed.
pub fn chosen(search: &Search) -> &Candidate {
    let mut best = &search.nominal;
    for effects in 1..=search.found.iter().map(|c| c.structure.added.len()).max().unwrap_or(0) {
        let next = search.found.iter().filter(|c| c.structure.added.len() == effects).min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let Some(next) = next else { continue };
        let next = search
            .found
            .iter()
            .filter(|c| c.structure.added.len() == effects)
            .fold(next, |best, c| if evidence(search, best, c) > 0.0 { c } else { best });
        // Ties go to the fewest numbers, then to the physics that is named first.
        let simplest = search
            .found
            .iter()
            .filter(|c| c.structure.added.len() == effects && evidence(search, c, next) < TIE)
            .min_by_key(|c| (c.structure.numbers.len(), c.structure.added.iter().map(order).sum::<usize>()))
            .unwrap_or(next);
        if worth(search, best, simplest) {
            best = simplest;
        }
    }
    best
}

fn order(h: &Hypothesis) -> usize {
    PHYSICS.iter().position(|p| p.name == h.physics).unwrap_or(usize::MAX)
}

/// What the fits and the recordings that no fit has seen say for a candidate against another one, as a difference of information
/// criteria with effective samples.
fn evidence(search: &Search, base: &Candidate, better: &Candidate) -> f64 {
    advantage_over(base, better, search.samples) + unseen_evidence(search, base, better)
}

/// What the recordings that no fit has seen say alone; 0 where there are none.
fn unseen_evidence(search: &Search, base: &Candidate, better: &Candidate) -> f64 {
    match (base.unseen, better.unseen) {
        (Some(a), Some(b)) if a.mean_square > 0.0 && b.mean_square > 0.0 => {
            (search.unseen_samples as f64 / a.correlation_time.max(b.correlation_time)) * (a.mean_square / b.mean_square).ln()
        }
        _ => 0.0,
    }
}

fn worth(search: &Search, base: &Candidate, better: &Candidate) -> bool {
    // What no fit has seen must not speak against it: a law that is there is there in every recording, if not always to be seen.
    let seen_again = match (base.unseen, better.unseen) {
        (Some(a), Some(b)) => b.mean_square < a.mean_square * 1.005,
        _ => true,
    };
    evidence(search, base, better) > LEAST_ADVANTAGE && better.fit.cost < (1.0 - LEAST_SHARE) * base.fit.cost && seen_again
}

/// Says what a search found. `model_name` is the name under which the model will be written.
///
/// # Errors
/// When what was found cannot be written into the model's text.
pub fn verdict(problem: &Problem, search: &Search, model_name: &str) -> Result<Verdict, VerdictError> {
    let best = chosen(search);
    let evaluator = Evaluator { floor: search.floor.clone(), ..Evaluator::new(problem) };
    let spread = Spread::measured(&evaluator, best);
    let at_floor = best.levels.iter().all(|l| *l < LEFT_OVER);
    let nominal_cost = search.nominal.fit.cost;
    let excess = |c: f64| (c / search.samples as f64 - 1.0).max(0.0);
    let explained = 1.0 - excess(best.fit.cost) / excess(nominal_cost).max(1e-12);
    let added = !best.structure.added.is_empty();
    let bursts = bursts(problem, best);
    let alike = alike(search, best);
    let nominal = &search.nominal;
    let off = given_is_off(problem, search) && (added || spread.is_far(nominal, &stated_in(problem, &nominal.structure)));
    let wanders = nominal.slowness > WANDERS && nominal.levels.iter().any(|l| *l > AT_FLOOR);
    let word = match () {
        () if added && (at_floor || explained > 0.99) && !alike.is_empty() => "ambiguous",
        () if added && (at_floor || explained > 0.99) => "missing",
        () if added => "unexplained",
        () if !bursts.is_empty() => "unexplained",
        () if !at_floor && nominal.correlation_time > 3.0 || wanders => "unexplained",
        () if off => "parameters",
        () if !is_excited(problem, search) => "cannot_tell",
        () => "nothing_missing",
    };
    let until = Moment::now() + EXPERIMENT;
    let planned = match word {
        "ambiguous" => Some(separate(problem, &[&[best], alike.as_slice()].concat(), &search.floor, until)),
        "cannot_tell" => best.structure.model(problem, &best.fit.values).map(|model| {
            let all: Vec<usize> = (0..best.structure.numbers.len()).collect();
            excite(problem, &model, &best.structure, &best.fit.values, &all, &search.floor, until)
        }),
        _ => None,
    };
    let (next, experiment) = match planned {
        Some(Ok(plan)) => (plan.json(EXPERIMENT_FILE), Some(plan.text)),
        Some(Err(reason)) => (json!({ "sentence": reason.to_string() }), None),
        None => (Json::Null, None),
    };
    let adequacy = adequacy(best);
    let findings = findings(search, best, &spread, adequacy);
    let held = held_out(problem, search, best, off || added);
    let model = model_text(problem, best, &spread, off || added)?;
    let parameters = if off || added { moved(problem, best, &spread) } else { json!({}) };
    let sentence = sentence(word, best);
    let rivals = rival_models(problem, search, best);
    let json = json!({
        "schema": 1,
        "verdict": word,
        "sentence": sentence,
        "findings": findings,
        "where": place_in_signals(problem, search, &bursts),
        "parameters": parameters,
        "held_out": held,
        "unknown_inputs": unknown_inputs(problem, best),
        "model_after": model_name,
        "rival_models": (1..=rivals.len()).map(rival_file).collect::<Vec<_>>(),
        "next_experiment": next,
        "detectable": if added { Json::Null } else { detectable(search) },
    });
    Ok(Verdict { json, model, rivals, sentence, experiment })
}

/// What was found of the inputs that nobody measured.
fn unknown_inputs(problem: &Problem, best: &Candidate) -> Vec<Estimated> {
    let records = best.structure.with_unknown(problem, &problem.fit, &best.fit.values);
    let one = |unknown: &Unknown| {
        let name = problem.model.inputs.get(unknown.input).map_or("", |i| i.name.as_str());
        let curves: Vec<(Vec<f64>, f64)> = records.iter().map(|r| (r.inputs[unknown.input].clone(), r.period)).collect();
        estimated(name, unknown, &curves)
    };
    problem.unknown.iter().map(one).collect()
}

/// Samples a burst may span, and how many spreads away it starts.
const BURST: (usize, f64) = (40, 8.0);

/// Times at which a motion sensor is far off for a moment while all the rest is measuring error, s: glitches, which no physics of the
/// device makes. Empty where the rest is no measuring error, or a reversal of friction could be it.
fn bursts(problem: &Problem, best: &Candidate) -> Vec<[f64; 2]> {
    use backdrive_plant::model::OutputKind;
    let evaluator = crate::fit::Evaluator::new(problem);
    let mut all = Vec::new();
    for (r, output, range) in evaluator.layout() {
        let Some(part) = best.fit.residuals.get(range) else { continue };
        if matches!(problem.model.outputs[output].kind, OutputKind::Reaction(_)) {
            continue;
        }
        let mut sizes: Vec<f64> = part.iter().map(|x| x.abs()).collect();
        let middle = sizes.len() / 2;
        let spread = 1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        // A rounded signal may well be right in more than half of its samples.
        let far = BURST.1 * spread.max(1.0);
        let away: Vec<usize> = part.iter().enumerate().filter(|(_, x)| x.abs() > far).map(|(i, _)| i).collect();
        if away.len() < 3 || away.len() * 50 > part.len() {
            continue;
        }
        let mut groups: Vec<(usize, usize)> = Vec::new();
        for i in away {
            match groups.last_mut() {
                Some(group) if i - group.1 <= BURST.0 => group.1 = i,
                _ => groups.push((i, i)),
            }
        }
        let period = problem.fit[r].period;
        all.extend(groups.iter().filter(|g| g.1 - g.0 <= 4 * BURST.0).map(|g| [g.0 as f64 * period, (g.1 + 1) as f64 * period]));
    }
    all
}

/// Whether the refitted numbers explain more than the given ones do.
fn given_is_off(problem: &Problem, search: &Search) -> bool {
    let each: Vec<f64> = search.levels_given.clone();
    let total: usize = problem.fit.iter().map(|r| crate::fit::measured(r).map(|_| r.len).sum::<usize>()).sum();
    let mut cost = 0.0;
    for record in &problem.fit {
        for output in crate::fit::measured(record) {
            cost += each.get(output).map_or(0.0, |l| l * l) * record.len as f64;
        }
    }
    let refit = &search.nominal;
    let numbers = refit.structure.numbers.len();
    advantage(cost, 0, refit.fit.cost, numbers, total, refit.correlation_time) > 0.0 && refit.fit.cost < 0.99 * cost
}

/// Where the stated numbers are among a structure's, and what the nominal file says.
fn stated_in(problem: &Problem, structure: &Structure) -> Vec<(usize, f64)> {
    let one = |(place, number): (usize, &Number)| match number.role {
        Role::Stated(i) => Some((place, problem.stated.get(i)?.given)),
        _ => None,
    };
    structure.numbers.iter().enumerate().filter_map(one).collect()
}

/// Structures of as many effects that cannot be told from the best: another place, or a law that is no richer form of its own.
fn alike<'s>(search: &'s Search, best: &Candidate) -> Vec<&'s Candidate> {
    let ids = |c: &Candidate| c.structure.added.iter().map(|h| h.id.clone()).collect::<HashSet<String>>();
    let own = ids(best);
    let differs = |c: &Candidate| {
        let other: Vec<&Hypothesis> = c.structure.added.iter().filter(|h| !own.contains(&h.id)).collect();
        let mine: Vec<&Hypothesis> = best.structure.added.iter().filter(|h| !ids(c).contains(&h.id)).collect();
        match (other.as_slice(), mine.as_slice()) {
            ([rival], [own]) => !(rival.place.same(&own.place) && contains(rival.physics, own)) && rival.class != own.class,
            ([], _) => false,
            _ => true,
        }
    };
    let mut seen = HashSet::new();
    let close = |c: &&Candidate| c.structure.added.len() == best.structure.added.len() && evidence(search, c, best) < ALIKE && differs(c);
    search.found.iter().filter(close).filter(|c| seen.insert(c.structure.name())).take(3).collect()
}

/// Whether a physics has another one, or one of its family at the same place, as a special or limiting case.
fn contains(rich: &str, own: &Hypothesis) -> bool {
    withheld(&[own.physics]).contains(&rich) || physics_named(rich).is_some_and(|p| p.family == own.family)
}

/// How far what is left over is measuring error: 1 where it has its size and hangs together no more than it, less the more of either. A law
/// that only imitates what is there leaves a little over, and that little is not white.
fn adequacy(best: &Candidate) -> f64 {
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let size = (-(level - NOISE_LEVEL).max(0.0) / 0.15).exp();
    let whiteness = (-(best.correlation_time - NOISE_MEMORY).max(0.0) / 1.5).exp();
    (size * whiteness).max(0.05)
}

/// Whether the recordings move the device by more than the measuring error.
fn is_excited(problem: &Problem, search: &Search) -> bool {
    let moves = |(output, floor): (usize, &f64)| {
        problem.fit.iter().any(|r| r.outputs.get(output).is_some_and(Option::is_some) && r.spread[output] > 5.0 * floor)
    };
    search.floor.iter().enumerate().any(moves)
}

/// What would have been seen: for each physics the smallest size at the place where it shows best.
fn detectable(search: &Search) -> Json {
    let one = |d: &crate::search::Detectable| {
        let mut entry = place(&d.place);
        entry["physics"] = json!(d.physics);
        entry[&d.key] = json!(round_significant(d.size, 3));
        entry["unit"] = json!(d.unit);
        entry
    };
    json!(search.detectable.iter().map(one).collect::<Vec<Json>>())
}

fn findings(search: &Search, best: &Candidate, spread: &Spread, adequacy: f64) -> Vec<Json> {
    let total = best.structure.added.len();
    let mut all: Vec<(f64, Json)> = Vec::new();
    for (h, hypothesis) in best.structure.added.iter().enumerate() {
        let rivals = rivals(search, best, h);
        // The weight of each, softened: a simulator is never the device.
        // A richer law at the same place that fits no better is the same law.
        let nested = |rival: &Hypothesis| rival.place.same(&hypothesis.place) && contains(rival.physics, hypothesis);
        let weight = |(rival, behind): &(Hypothesis, f64)| (-behind.max(0.0) / 20.0).exp() * if nested(rival) { 0.1 } else { 1.0 };
        let weights: Vec<f64> = rivals.iter().map(weight).collect();
        // And of those that promised as much, but were not fitted: little, for they did not win their race.
        let own = search.tried.iter().find(|t| t.id == hypothesis.id).map_or(1.0, |t| t.promised);
        let unfitted = search.tried.iter().filter(|t| t.taken.is_none() && t.promised > 0.9 * own).count() as f64;
        let sum = 1.0 + weights.iter().sum::<f64>() + 0.02 * unfitted.min(10.0);
        let alternatives: Vec<Json> = rivals
            .iter()
            .zip(&weights)
            .take(6)
            .map(|((rival, _), weight)| {
                let mut entry = place(&rival.place);
                entry["physics"] = json!(rival.physics);
                entry["confidence"] = json!(round_significant(weight / sum, 3));
                entry
            })
            .collect();
        let mut entry = place(&hypothesis.place);
        entry["physics"] = json!(hypothesis.physics);
        entry["parameters"] = parameters_of(best, spread, h);
        entry["replaces"] = json!(hypothesis.replaces);
        entry["confidence"] = json!(round_significant(adequacy / sum, 3));
        entry["alternatives"] = json!(alternatives);
        // What the cost would be without it tells how important it is.
        let without = search
            .found
            .iter()
            .filter(|c| {
                c.structure.added.len() + 1 == total
                    && c.structure.added.iter().all(|o| o.id != hypothesis.id && best.structure.added.iter().any(|b| b.id == o.id))
            })
            .map(|c| c.fit.cost)
            .fold(search.nominal.fit.cost, f64::min);
        all.push((without, entry));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, entry)| entry).collect()
}

/// What stands in the place of one hypothesis in structures that are else the same, and how far it is behind.
fn rivals(search: &Search, best: &Candidate, which: usize) -> Vec<(Hypothesis, f64)> {
    let own = &best.structure.added[which];
    let others: Vec<&str> = best.structure.added.iter().filter(|h| h.id != own.id).map(|h| h.id.as_str()).collect();
    let mut found: Vec<(Hypothesis, f64)> = Vec::new();
    for candidate in search.found.iter().filter(|c| c.structure.added.len() == best.structure.added.len()) {
        let added = &candidate.structure.added;
        let rest: Vec<&Hypothesis> = added.iter().filter(|h| !others.contains(&h.id.as_str())).collect();
        let [rival] = rest.as_slice() else { continue };
        if rival.id != own.id && added.len() - 1 == others.len() {
            found.push(((*rival).clone(), evidence(search, candidate, best)));
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    // However finely a law is drawn, it is one physics.
    let same = |a: &Hypothesis, b: &Hypothesis| a.physics == b.physics && a.place.same(&b.place);
    let mut each: Vec<(Hypothesis, f64)> = Vec::new();
    for (rival, behind) in found {
        if !same(&rival, own) && !each.iter().any(|(other, _)| same(&rival, other)) {
            each.push((rival, behind));
        }
    }
    each
}

fn place(place: &Place) -> Json {
    match place {
        Place::Between(a, b) => json!({ "between": [a, b] }),
        Place::Signal(name) => json!({ "signal": name }),
    }
}

fn parameters_of(best: &Candidate, spread: &Spread, which: usize) -> Json {
    let hypothesis = &best.structure.added[which];
    let mut all = serde_json::Map::new();
    for (index, number) in best.structure.numbers.iter().enumerate() {
        let Role::Added(h, p) = number.role else { continue };
        let Some(parameter) = hypothesis.parameters.get(p).filter(|_| h == which) else { continue };
        let (value, [low, high]) = (best.fit.values[index], spread.interval(best, index));
        let r = |x: f64| json!(round_significant(x, 5));
        if parameter.index.is_some() {
            let entry = all.entry(parameter.key.clone()).or_insert_with(|| json!({ "value": [], "ci95": [], "unit": parameter.unit }));
            for (key, x) in [("value", r(value)), ("ci95", json!([r(low), r(high)]))] {
                if let Some(list) = entry.get_mut(key).and_then(Json::as_array_mut) {
                    list.push(x);
                }
            }
        } else {
            all.insert(parameter.key.clone(), json!({ "value": r(value), "ci95": [r(low), r(high)], "unit": parameter.unit }));
        }
    }
    Json::Object(all)
}

fn moved(problem: &Problem, best: &Candidate, spread: &Spread) -> Json {
    let mut all = serde_json::Map::new();
    for (index, number) in best.structure.numbers.iter().enumerate() {
        let Role::Stated(i) = number.role else { continue };
        let (stated, value, [low, high]) = (&problem.stated[i], best.fit.values[index], spread.interval(best, index));
        let r = |x: f64| json!(round_significant(x, 5));
        let list = problem.stated.iter().filter(|s| s.path == stated.path).count() > 1;
        let key = if list { format!("{}[{}]", stated.path, stated.index) } else { stated.path.clone() };
        let deviation = spread.deviation[index];
        let away = (number.inward(value) - number.inward(stated.given)) / deviation;
        all.insert(
            key,
            json!({ "value": r(value), "ci95": [r(low), r(high)], "nominal": stated.given, "moved_sd": round_significant(away, 3) }),
        );
    }
    Json::Object(all)
}

fn held_out(problem: &Problem, search: &Search, best: &Candidate, use_best: bool) -> Json {
    let records = if problem.held_out.is_empty() { &problem.fit } else { &problem.held_out };
    let structure = &search.nominal.structure;
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let before = nrmse(problem, records, structure, &structure.values(problem, &given, &[], &[]));
    let refit = nrmse(problem, records, structure, &search.nominal.fit.values);
    let after = if use_best { nrmse(problem, records, &best.structure, &best.fit.values) } else { before };
    let (mut sum, mut count) = (0.0, 0usize);
    for record in records {
        for output in crate::fit::measured(record) {
            sum += search.floor[output] / record.spread[output];
            count += 1;
        }
    }
    let r = |x: Option<f64>| x.map_or(Json::Null, |x| json!(round_significant(x, 6)));
    json!({ "nrmse_before": r(before), "nrmse_refit": r(refit), "nrmse_after": r(after), "noise_floor": r(Some(sum / count.max(1) as f64)) })
}

/// The nominal model's text with the fitted numbers and what was found.
fn model_text(problem: &Problem, best: &Candidate, spread: &Spread, use_best: bool) -> Result<String, VerdictError> {
    if !use_best {
        return Ok(problem.text.clone());
    }
    let mut edits = stated_edits(problem, best, spread);
    let mut model = problem.model.clone();
    apply_edits(&mut model, &edits).map_err(VerdictError::Refitted)?;
    for (hypothesis, values) in best.structure.added.iter().zip(best.structure.added_of(&best.fit.values)) {
        let rounded: Vec<f64> = values.iter().map(|v| round_significant(*v, 7)).collect();
        edits.extend(hypothesis.edits(&model, &rounded)?);
        model = hypothesis.apply(&model, &rounded)?;
    }
    Ok(patch(&problem.text, &edits)?)
}

/// Models of other structures that explain nearly as much of what was fitted and of what no fit has seen.
fn rival_models(problem: &Problem, search: &Search, best: &Candidate) -> Vec<String> {
    let names = |c: &Candidate| c.structure.added.iter().map(|h| h.id.clone()).collect::<Vec<_>>();
    let near = |c: &&Candidate| {
        let unseen = match (best.unseen, c.unseen) {
            (Some(a), Some(b)) => b.mean_square <= NEARLY * a.mean_square,
            _ => true,
        };
        unseen && c.fit.cost <= NEARLY * best.fit.cost && names(c) != names(best)
    };
    let mut rivals: Vec<&Candidate> = search.found.iter().chain([&search.nominal]).filter(near).collect();
    rivals.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
    let models = rivals.into_iter().filter_map(|c| c.structure.model(problem, &c.fit.values));
    models.take(RIVALS).map(|model| model.to_toml()).collect()
}

/// When and at which frequencies the refitted nominal model leaves most over.
fn place_in_signals(problem: &Problem, search: &Search, bursts: &[[f64; 2]]) -> Json {
    let residuals = &search.nominal.fit.residuals;
    let evaluator = crate::fit::Evaluator::new(problem);
    let mut strongest: Option<(f64, [f64; 2], [f64; 2])> = None;
    for (r, _, range) in evaluator.layout() {
        let Some(part) = residuals.get(range) else { continue };
        let period = problem.fit[r].period;
        let window = (part.len() / 20).max(1);
        let sums: Vec<f64> = part.chunks(window).map(|c| c.iter().map(|x| x * x).sum::<f64>()).collect();
        let Some((at, most)) = sums.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) else { continue };
        if strongest.as_ref().is_none_or(|s| *most > s.0) {
            let time = [at as f64 * window as f64 * period, ((at + 1) * window).min(part.len()) as f64 * period];
            strongest = Some((*most, time, band(part, period)));
        }
    }
    let Some((_, time, band)) = strongest else { return Json::Null };
    let r = |x: f64| round_significant(x, 4);
    let times: Vec<[f64; 2]> = if bursts.is_empty() { vec![time] } else { bursts.to_vec() };
    let times: Vec<[f64; 2]> = times.iter().take(20).map(|t| [r(t[0]), r(t[1])]).collect();
    json!({ "time": times, "band_hz": [r(band[0]), r(band[1])], "state": Json::Null })
}

/// Frequencies between which the middle eight tenths of a signal's energy lie, Hz.
fn band(samples: &[f64], period: f64) -> [f64; 2] {
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(samples.len());
    let (mut input, mut output) = (samples.to_vec(), transform.make_output_vec());
    if transform.process(&mut input, &mut output).is_err() {
        return [0.0, 0.5 / period];
    }
    let energy: Vec<f64> = output.iter().map(|c| c.norm_sqr()).collect();
    let total: f64 = energy.iter().sum();
    let hz = |index: usize| index as f64 / (samples.len() as f64 * period);
    let at = |share: f64| {
        let mut sum = 0.0;
        hz(energy
            .iter()
            .position(|e| {
                sum += e;
                sum >= share * total
            })
            .unwrap_or(0))
    };
    [at(0.1), at(0.9)]
}

fn sentence(word: &str, best: &Candidate) -> String {
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let end = if level < AT_FLOOR { "down to the noise".to_string() } else { format!("to {level:.2} floors") };
    match word {
        "ambiguous" => format!("the model leaves out {} or something that the recordings cannot tell from it", best.structure.name()),
        "cannot_tell" => "the recordings hardly move the device: they cannot tell what is missing".to_string(),
        "missing" => format!("the model leaves out {}; with it the recordings are explained {end}", best.structure.name()),
        "unexplained" if best.structure.added.is_empty() => {
            format!("something is missing that none of the laws tried explains; refitted, the model comes {end}")
        }
        "unexplained" => format!("something is missing that no known physics explains; the nearest is {}, {end}", best.structure.name()),
        "parameters" => format!("nothing is missing, but the model's numbers are off; refitted they explain the recordings {end}"),
        _ => format!("the model explains the recordings {end}"),
    }
}
