//! The end of a search: the best made simpler and brought to their ends, and held against held-out recordings.

use super::nominal::{Nominal, to_its_end};
use super::share::Work;
use crate::belief::compare::unseen;
use crate::belief::intervals::Uncertainty;
use crate::hypothesis::{self, Hypothesis};
use crate::output_error::candidate::{Candidate, candidate, key_of, sort};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::{FreeParameter, Role, Structure};
use crate::output_error::work::Budget;
use crate::physics;
use crate::search::race::Course;
use crate::tuning::tuning;
use rayon::prelude::*;

/// An effect may only have helped the other parameters out of a local minimum. So each effect of the best structure is removed again, and the others are
/// refitted from their present values. A law of many parameters must also be better than the laws that it contains. One such step may open the next.
pub(super) fn make_simpler(course: &Course, found: &mut Vec<Candidate>, work: &Work) {
    let samples = course.nominal.fit.residuals.len();
    let last = course.evaluator.within(work.up_to(tuning().search.best_end));
    for _ in 0..tuning().search.simpler {
        let before = found.first().map(|c| key_of(&c.structure.added));
        found.extend(polished(&last, fewer(course, found)));
        sort(found, samples);
        if found.first().map(|c| key_of(&c.structure.added)) == before {
            break;
        }
    }
}

/// Fits those that could still win, or tie with the best, to their ends. Far from the noise a fit may have ended at parameters that compensate the
/// integration error of few substeps. So it is judged, and continued, with as many substeps as the model asks for, even where the time is up.
pub(super) fn bring_to_their_ends(evaluator: &Evaluator, found: &mut [Candidate], nominal: &Candidate, work: &Work) {
    let samples = nominal.fit.residuals.len();
    let exact_end = work.share(tuning().search.best_end).max(work.budget.spent() + work.share(tuning().search.refitted));
    let (last, exact) = (work.up_to(tuning().search.best_end), work.budget.extended(exact_end));
    let best = found.first().map_or(f64::INFINITY, |c| c.fit.cost);
    let unit = best / samples as f64;
    let open = |c: &Candidate| {
        c.fit.predicted_decrease > tuning().fit.to_the_end.tolerance * unit
            && c.fit.cost - 2.0 * c.fit.predicted_decrease < best + tuning().search.open_advantage * unit * c.correlation_time
    };
    let near: Vec<usize> =
        (0..found.len().min(tuning().search.last_fits)).filter(|i| found[*i].fit.cost < tuning().search.behind_at_noise * best).collect();
    let polish = |budget: &Budget, i: usize| -> Option<(usize, Fit)> {
        let c = &found[i];
        let evaluator = evaluator.within(budget.clone());
        let cost = evaluator.residuals(&c.structure, &c.fit.values).map_or(f64::INFINITY, |r| evaluator.cost(&r));
        // What is too little to be claimed has no need of its last digits.
        if cost.min(c.fit.cost) - 2.0 * c.fit.predicted_decrease > (1.0 - tuning().claim.least_share) * nominal.fit.cost {
            return None;
        }
        let is_blurred = (cost - c.fit.cost).abs() > tuning().screening.substep_error * c.fit.cost;
        let by = match (is_blurred, open(c)) {
            (true, _) => budget.clone(),
            (false, true) => budget.until(last.end()),
            (false, false) => return None,
        };
        Some((i, evaluator.within(by).fit(&c.structure, &c.fit.values, tuning().fit.to_the_end)?))
    };
    let polished: Vec<(usize, Fit)> = exact.abreast(&near, |budget, i| polish(budget, *i)).into_iter().flatten().flatten().collect();
    for (i, fit) in polished {
        found[i] = candidate(evaluator, found[i].structure.clone(), fit);
    }
    sort(found, samples);
}

/// An effect that may be nothing may only have guided the parameters around a curved valley of the cost. So, from the best, each such effect is driven to
/// zero in steps while all other parameters are refitted (continuation). Gives the starts for the remaining parameters. A fit from another start does not
/// get there through a curved valley.
pub(super) fn taken_back(evaluator: &Evaluator, found: &mut [Candidate], work: &Work) -> Vec<(Structure, Vec<f64>)> {
    let problem = evaluator.problem;
    let Some(best) = found.first_mut() else { return Vec::new() };
    let spread = Uncertainty::measured(evaluator, best);
    let unsure: Vec<Option<(usize, f64)>> = (0..best.structure.added.len()).map(|which| may_be_nothing(best, &spread, which)).collect();
    best.may_be_nothing = unsure.iter().any(Option::is_some);
    let best = &*best;
    let along = evaluator.within(work.up_to(tuning().search.best_end));
    let one = |which: usize| {
        let (number, neutral) = unsure.get(which).copied().flatten()?;
        let mut structure = best.structure.clone();
        let mut values = best.fit.values.clone();
        let own = |values: &[f64]| structure_value(&best.structure, values, number);
        let size = own(&values) - neutral;
        for share in tuning().search.taken_back {
            let target = neutral + share * size;
            structure.free[number].prior = Some((target, HELD * size.abs()));
            values[number] = best.structure.free[number].to_external(target);
            values = along.fit(&structure, &values, tuning().fit.to_the_end)?.values;
        }
        let rest: Vec<Hypothesis> = best.structure.added.iter().enumerate().filter(|(i, _)| *i != which).map(|(_, h)| h.clone()).collect();
        let added: Vec<Vec<f64>> =
            structure.added_of(&values).into_iter().enumerate().filter(|(i, _)| *i != which).map(|(_, values)| values).collect();
        let without = Structure::new(problem, &problem.fit, rest);
        let start = without.values(problem, &structure.stated_of(problem, &values), &added, &structure.of_records(&values));
        Some((without, start))
    };
    (0..best.structure.added.len()).filter_map(one).collect()
}

/// Standard deviation of the prior that holds a parameter at a step of the way back, as a share of what it was.
const HELD: f64 = 0.01;

fn structure_value(structure: &Structure, values: &[f64], number: usize) -> f64 {
    structure.free[number].to_internal(values[number])
}

/// The size of an effect among a fit's parameters, and in the fit's own unit where it has none, if the recordings do not surely tell the two apart.
fn may_be_nothing(candidate: &Candidate, spread: &Uncertainty, which: usize) -> Option<(usize, f64)> {
    let structure = &candidate.structure;
    let hypothesis = structure.added.get(which)?;
    let is_size = |n: &FreeParameter| matches!(n.role, Role::Added(h, p) if h == which && hypothesis.parameters[p].key == hypothesis.physics.size && hypothesis.parameters[p].index.is_none());
    let number = structure.free.iter().position(is_size)?;
    let Role::Added(_, place) = structure.free[number].role else { return None };
    let neutral = hypothesis.parameters[place].neutral.filter(|n| n.is_finite() && !structure.free[number].log)?;
    let deviation = *spread.deviation.get(number)?;
    let away = structure_value(structure, &candidate.fit.values, number) - neutral;
    (away != 0.0 && away.abs() < tuning().claim.may_be_nothing * deviation).then_some((number, neutral))
}

/// The nominal model at its end. The parameters of what was found may take it out of a wrong valley: then there was less to find.
pub(super) fn nominal_at_its_end(nominal: &Nominal, found: &[Candidate], taken_back: &[Vec<f64>], work: &Work) -> Candidate {
    let (evaluator, refitted) = (&nominal.evaluator, &nominal.refitted);
    let problem = evaluator.problem;
    let numbers = |c: &Candidate| (c.structure.stated_of(problem, &c.fit.values), c.structure.of_records(&c.fit.values));
    let others = found.iter().take(tuning().search.nominal_from).map(numbers);
    // Far from the noise its last thousandths say nothing.
    let effort = if nominal.is_far { tuning().fit.nominal_far } else { tuning().fit.to_the_end };
    let substeps = if nominal.is_far { problem.middle_substeps() } else { evaluator.substeps };
    let last = Evaluator { substeps, ..evaluator.within(work.up_to(tuning().search.nominal_end)) };
    let mut better = None;
    let starts = others.chain(nominal.is_far.then(|| numbers(refitted)));
    let starts = starts.map(|(stated, of_records)| refitted.structure.values(problem, &stated, &[], &of_records));
    for start in taken_back.iter().cloned().chain(starts) {
        let least = better.as_ref().map_or(refitted.fit.cost, |f: &Fit| f.cost);
        if let Some(fit) = last.fit(&refitted.structure, &start, effort)
            && fit.cost < (1.0 - tuning().fit.relative_tolerance) * least
        {
            better = Some(fit);
        }
    }
    match better {
        Some(fit) => candidate(evaluator, refitted.structure.clone(), to_its_end(&last, &refitted.structure, fit)),
        None => refitted.clone(),
    }
}

/// Holds the nominal model and the best with so many effects each against the held-out recordings: those may speak for fewer effects than
/// fits do. How many samples there are.
pub(super) fn hold_against_unseen(evaluator: &Evaluator, found: &mut [Candidate], nominal: &mut Candidate) -> usize {
    let problem = evaluator.problem;
    let mut so_many = vec![0; found.iter().map(|c| c.structure.added.len() + 1).max().unwrap_or(0)];
    let finalists = found.iter_mut().filter(|c| {
        let before = so_many.get_mut(c.structure.added.len());
        before.is_some_and(|n| std::mem::replace(n, *n + 1) < tuning().search.finalists)
    });
    let mut finalists: Vec<&mut Candidate> = finalists.chain(std::iter::once(nominal)).collect();
    finalists.par_iter_mut().for_each(|c| {
        c.unseen = unseen(problem, &problem.held_out, &c.structure, &c.fit.values, &evaluator.noise_sd);
    });
    Evaluator::on(problem, &problem.held_out).len()
}

/// Each fitted from where it starts.
pub(super) fn polished(evaluator: &Evaluator, structures: Vec<(Structure, Vec<f64>)>) -> Vec<Candidate> {
    let fit = |budget: &Budget, (structure, start): &(Structure, Vec<f64>)| {
        evaluator.within(budget.clone()).fit(structure, start, tuning().fit.to_the_end)
    };
    let fits = evaluator.budget.abreast(&structures, fit);
    let fitted = structures.iter().zip(fits).filter_map(|((structure, _), fit)| Some((structure, fit.flatten()?)));
    fitted.map(|(structure, fit)| candidate(evaluator, structure.clone(), fit)).collect()
}

/// The best with each of its effects left out, where there is more than one, or replaced by a simpler law that it contains. Also where to start: from the
/// present values of all other parameters.
fn fewer(course: &Course, found: &[Candidate]) -> Vec<(Structure, Vec<f64>)> {
    let problem = course.evaluator.problem;
    let Some(best) = found.first() else { return Vec::new() };
    let (stated, of_records) = (best.structure.stated_of(problem, &best.fit.values), best.structure.of_records(&best.fit.values));
    let own: Vec<(Hypothesis, Vec<f64>)> = best.structure.added.iter().cloned().zip(best.structure.added_of(&best.fit.values)).collect();
    let made = |effects: Vec<(Hypothesis, Vec<f64>)>| {
        let (added, values): (Vec<_>, Vec<_>) = effects.into_iter().unzip();
        let structure = Structure::new(problem, &problem.fit, added);
        let start = structure.values(problem, &stated, &values, &of_records);
        (structure, start)
    };
    let mut all = Vec::new();
    for (out, (effect, values)) in own.iter().enumerate() {
        if own.len() > 1 {
            let rest = own.iter().enumerate().filter(|(i, _)| *i != out).map(|(_, effect)| effect.clone());
            all.push(made(rest.collect()));
        }
        let simpler = |h: &&Hypothesis| {
            h.place.same(&effect.place) && physics::contains(effect.physics, h.physics) && h.parameters.len() < effect.parameters.len()
        };
        for law in course.hypotheses.iter().filter(simpler) {
            let Some(start) = hypothesis::starts_beside(effect, values, law).into_iter().next() else { continue };
            let start = hypothesis::inherited(law, &start, effect, values);
            let mut effects = own.clone();
            effects[out] = (law.clone(), start);
            all.push(made(effects));
        }
    }
    all
}
