//! Explanations that screening promises as much of as of what was found, and that no fit was made of: they are fitted before anything is claimed.
//!
//! A search ends where the residual is white. Of several laws that do the same under the recorded motion it may have fitted one, and the others then look as if the
//! recordings had spoken against them. And a fit that was not at its end may look as if it still came as near.

use crate::belief::choice::chosen;
use crate::belief::compare::unseen;
use crate::hypothesis::{Hypothesis, Run, Scales, inherited, starts_beside};
use crate::output_error::candidate::{Candidate, advantage_over, candidate, key_of, sort};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::Structure;
use crate::output_error::work::Budget;
use crate::physics;
use crate::recordings::problem::Problem;
use crate::search::Search;
use crate::tuning::tuning;

/// The search, with fits of possible alternatives to each effect that would be claimed, as far as the budget allows. `without`: effects that are withheld.
pub fn with_contenders<'a>(problem: &'a Problem, search: Search, without: &[String], budget: &Budget<'a>) -> Search {
    let more = contenders(problem, &search, without, budget);
    let mut search = search;
    for (at, gone_on) in brought_on(problem, &search, budget) {
        if let Some(there) = search.found.get_mut(at) {
            *there = gone_on;
        }
    }
    search.work += budget.spent();
    search.simulations += budget.simulations();
    search.found.extend(more);
    sort(&mut search.found, search.samples);
    search
}

/// Fits that foresee to come as near as the best and are not there: they go on. One that then finds little of what it had foreseen does not foresee well, and is taken
/// to end where it is.
fn brought_on<'a>(problem: &'a Problem, search: &Search, budget: &Budget<'a>) -> Vec<(usize, Candidate)> {
    let best = chosen(search);
    let evaluator = Evaluator { noise_sd: search.noise_sd.clone(), budget: budget.clone(), ..Evaluator::new(problem) };
    let effective = (search.samples as f64 / best.correlation_time.max(1.0)).max(2.0);
    let is_open = |c: &Candidate| {
        let foreseen = effective * 2.0 * c.fit.predicted_decrease / c.fit.cost;
        let behind = advantage_over(c, best, search.samples);
        foreseen > 0.5 * tuning().claim.alike && behind < tuning().experiment.contender_behind
    };
    let is_other = |c: &Candidate| c.structure.added.len() == best.structure.added.len() && c.structure.name() != best.structure.name();
    let open: Vec<usize> = (0..search.found.len()).filter(|i| search.found.get(*i).is_some_and(|c| is_other(c) && is_open(c))).collect();
    let on = |budget: &Budget<'a>, at: &usize| {
        let before = search.found.get(*at)?;
        let mut fit = evaluator.within(budget.clone()).fit(&before.structure, &before.fit.values, tuning().fit.to_the_end)?;
        let gained = 0.5 * (before.fit.cost - fit.cost).max(0.0);
        fit.predicted_decrease = fit.predicted_decrease.min(gained);
        let mut after = candidate(&evaluator, before.structure.clone(), fit);
        after.unseen =
            before.unseen.as_ref().and_then(|_| unseen(problem, &problem.held_out, &after.structure, &after.fit.values, &search.noise_sd));
        Some((*at, after))
    };
    budget.abreast(&open, on).into_iter().flatten().flatten().collect()
}

/// What is fitted instead of one effect.
struct Seed<'h> {
    slot: usize,
    hypothesis: &'h Hypothesis,
    promised: f64,
}

fn contenders<'a>(problem: &'a Problem, search: &Search, without: &[String], budget: &Budget<'a>) -> Vec<Candidate> {
    let best = chosen(search);
    let nominal = &search.nominal;
    let Some(model) = nominal.structure.model(problem, &nominal.fit.values) else { return Vec::new() };
    let records = nominal.structure.with_unknown(problem, &problem.fit, &nominal.fit.values);
    let runs: Vec<Run> = records.iter().map(Run::from).collect();
    let Ok(scales) = Scales::of(&model, &runs) else { return Vec::new() };
    let withheld: Vec<&str> = without.iter().map(String::as_str).collect();
    let hypotheses = physics::without(physics::all(&model, &scales), &withheld);
    let hypotheses: Vec<Hypothesis> = hypotheses.into_iter().filter(|h| !problem.is_unmeasured(&h.place)).collect();
    let seeds = seeds(problem, search, best, &hypotheses);
    let evaluator = Evaluator { noise_sd: search.noise_sd.clone(), budget: budget.clone(), ..Evaluator::new(problem) };
    // What ends farther behind than this is no rival, whatever it is.
    let effective = (search.samples as f64 / best.correlation_time.max(1.0)).max(2.0);
    let limit = 1.0 + tuning().experiment.contender_behind / effective;
    let coarse = Evaluator { substeps: problem.coarse_substeps(), ..evaluator.clone() };
    let Some(there) = coarse.residuals(&best.structure, &best.fit.values).map(|r| coarse.cost(&r)).filter(|_| !seeds.is_empty()) else {
        return Vec::new();
    };
    let fitted = budget.abreast(&seeds, |budget, seed| fit(&evaluator.within(budget.clone()), (best, limit * there), seed));
    // A fit that was cut short is no evidence on its law.
    let is_done = |fit: &Fit| effective * 2.0 * fit.predicted_decrease < tuning().claim.alike * fit.cost;
    let near = fitted.into_iter().flatten().flatten().filter(|(_, fit)| fit.cost < limit * best.fit.cost && is_done(fit));
    let held_out = |mut c: Candidate| {
        c.unseen = unseen(problem, &problem.held_out, &c.structure, &c.fit.values, &search.noise_sd);
        c
    };
    near.map(|(structure, fit)| held_out(candidate(&evaluator, structure, fit))).collect()
}

/// What promises at least a good part of what an effect does, and was not fitted in its place; the most first.
fn seeds<'h>(problem: &Problem, search: &Search, best: &Candidate, hypotheses: &'h [Hypothesis]) -> Vec<Seed<'h>> {
    let promised = |h: &Hypothesis| search.tried.iter().find(|t| t.id == h.id).map_or(0.0, |t| t.promised);
    let is_number = |h: &Hypothesis| h.same_as.as_ref().is_some_and(|path| problem.stated.iter().any(|s| s.path == *path));
    let mut all: Vec<Seed> = Vec::new();
    for (slot, effect) in best.structure.added.iter().enumerate() {
        let others = || best.structure.added.iter().enumerate().filter(move |(i, _)| *i != slot).map(|(_, h)| h);
        let least = tuning().search.promise * promised(effect);
        let fits = |h: &&Hypothesis| h.class != effect.class && !is_number(h) && promised(h) > 0.0 && promised(h) >= least;
        for hypothesis in hypotheses.iter().filter(fits).filter(|h| others().all(|o| o.id != h.id && o.compatible(h))) {
            let key = key_of(others().chain([hypothesis]));
            if search.found.iter().all(|c| key_of(&c.structure.added) != key) {
                all.push(Seed { slot, hypothesis, promised: promised(hypothesis) });
            }
        }
    }
    // Of equals the simpler: a law of more parameters mostly does what it does as one of its limits.
    let numbers = |s: &Seed| s.hypothesis.parameters.len();
    all.sort_by(|a, b| numbers(a).cmp(&numbers(b)).then(b.promised.total_cmp(&a.promised)));
    all.truncate(tuning().experiment.contenders);
    all
}

/// The best with one effect exchanged, from the other parameters' values. The start that comes nearest in a few steps goes on, where it predicts a cost
/// below `limit`.
fn fit(evaluator: &Evaluator, (best, limit): (&Candidate, f64), seed: &Seed) -> Option<(Structure, Fit)> {
    let problem = evaluator.problem;
    let (mut added, mut values) = (best.structure.added.clone(), best.structure.added_of(&best.fit.values));
    let (effect, own) = (added.get(seed.slot)?.clone(), values.get(seed.slot)?.clone());
    *added.get_mut(seed.slot)? = seed.hypothesis.clone();
    let structure = Structure::new(problem, &problem.fit, added);
    let (stated, of_records) = (best.structure.stated_of(problem, &best.fit.values), best.structure.of_records(&best.fit.values));
    let coarse = Evaluator { substeps: problem.coarse_substeps(), ..evaluator.clone() };
    let mut nearest: Option<Fit> = None;
    for start in starts_beside(&effect, &own, seed.hypothesis).iter().take(tuning().experiment.contender_starts) {
        *values.get_mut(seed.slot)? = match seed.hypothesis.place.same(&effect.place) {
            true => inherited(seed.hypothesis, start, &effect, &own),
            false => start.clone(),
        };
        let from = structure.values(problem, &stated, &values, &of_records);
        let fit = coarse.fit(&structure, &from, tuning().fit.early);
        nearest = [nearest, fit].into_iter().flatten().min_by(|a, b| a.cost.total_cmp(&b.cost));
    }
    let nearest = nearest?;
    let may_come = nearest.cost - 2.0 * nearest.predicted_decrease < limit;
    let fit = may_come.then(|| evaluator.fit(&structure, &nearest.values, tuning().fit.to_the_end))??;
    Some((structure, fit))
}
