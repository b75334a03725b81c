//! The experiment that separates rival structures.

use super::planner::{Evaluated, Pair, Planner, same};
use super::rivals::Rival;
use super::setup::{Setup, Trial};
use super::types::{Experiment, Reason};
use crate::output_error::candidate::Candidate;
use crate::output_error::fit::Fit;
use crate::output_error::structure::Structure;
use crate::output_error::work::Budget;
use crate::recordings::problem::Problem;
use crate::tuning::tuning;
use rayon::prelude::*;

/// The excitation that separates fitted structures, the likeliest first. `noise_sd` is the noise standard deviation of each output, in its unit. What
/// exceeds the budget is not tried.
///
/// # Errors
/// States why when no excitation would, nor any further sensor: fewer than two structures, none that can be simulated, or a difference too small.
pub fn separate<'a>(problem: &'a Problem, candidates: &[&Candidate], noise_sd: &[f64], budget: &Budget<'a>) -> Result<Experiment, Reason> {
    let fitted: Vec<(&Structure, &Fit)> = candidates.iter().map(|c| (&c.structure, &c.fit)).collect();
    separate_fitted(problem, &fitted, noise_sd, budget)
}

/// The excitation that separates a law from one of more parameters that fits as well, clearly enough in one run of the excitation. Without that condition
/// every law would remain open because of every finer one. `contains`: whether the first is a special or limiting case of the second, which can then
/// imitate it.
///
/// # Errors
/// States why when none would.
pub fn confirm<'a>(
    problem: &'a Problem,
    [simple, rich]: [&Candidate; 2],
    contains: bool,
    noise_sd: &[f64],
    budget: &Budget<'a>,
) -> Result<Experiment, Reason> {
    let rivals = [simple, rich].map(|c| Rival::of(problem, &c.structure, &c.fit));
    let pair = Pair { a: 0, b: 1, directed: contains, least: tuning().experiment.wanted };
    separate_pairs(problem, &rivals, &[pair], noise_sd, budget)
}

pub(super) fn separate_fitted<'a>(
    problem: &'a Problem,
    fitted: &[(&Structure, &Fit)],
    noise_sd: &[f64],
    budget: &Budget<'a>,
) -> Result<Experiment, Reason> {
    let mut names = std::collections::HashSet::new();
    let others = fitted.iter().filter(|(structure, _)| names.insert(ids(structure)));
    let rivals: Vec<Rival> = others.take(tuning().experiment.rivals).map(|(structure, fit)| Rival::of(problem, structure, fit)).collect();
    let least = tuning().experiment.wanted / f64::from(tuning().experiment.most_repeats as u32).sqrt();
    let pair = |(a, b): (usize, usize)| Pair { a, b, directed: false, least };
    let all: Vec<Pair> = (0..rivals.len()).flat_map(|b| (0..b).map(move |a| (a, b))).map(pair).collect();
    separate_pairs(problem, &rivals, &all, noise_sd, budget)
}

fn separate_pairs<'a>(
    problem: &'a Problem,
    rivals: &[Rival],
    all: &[Pair],
    noise_sd: &[f64],
    budget: &Budget<'a>,
) -> Result<Experiment, Reason> {
    let Some(first) = all.first() else { return Err(Reason("there is only one explanation".to_string())) };
    let planner = Planner::new(problem, noise_sd, budget)?;
    let distinct: Vec<Pair> = all.iter().copied().filter(|p| !same(rivals[p.a].structure, rivals[p.b].structure)).collect();
    let mut cases = planner.cases(rivals);
    if cases.is_empty() {
        return Err(Reason("no excitation could be simulated with all of the explanations".to_string()));
    }
    let evaluated = planner.evaluate(rivals, &mut cases, &distinct);
    let reached = |p: &Pair| evaluated.iter().any(|e| e.of(*p) >= p.least);
    let separable: Vec<Pair> = distinct.iter().copied().filter(reached).collect();
    if separable.is_empty() {
        let pair = distinct.first().unwrap_or(first);
        return planner.with_sensor(rivals, &cases, *pair, evaluated.iter().map(|e| e.of(*pair)).fold(0.0, f64::max));
    }
    let mut ranked: Vec<&Evaluated> = evaluated.iter().collect();
    // Those that tell every pair come before those that are quicker and do not.
    let tells = |e: &Evaluated| separable.iter().all(|p| e.of(*p) >= p.least);
    ranked.sort_by(|a, b| tells(b).cmp(&tells(a)).then(b.score(&separable, &cases).total_cmp(&a.score(&separable, &cases))));
    let fine = Setup { substeps: tuning().experiment.substeps[1], ..planner.setup.clone() };
    let refitted = |e: &&Evaluated| {
        let trial = &cases[e.case].trial;
        let left = |p: &Pair| {
            let left = refitted(&fine, rivals, trial, *p);
            // A refit that was cut short gives too large a separation.
            (*p, if budget.is_over() { left.min(e.of(*p)) } else { left })
        };
        let worst = separable.iter().map(left).min_by(|a, b| (a.1 / a.0.least).total_cmp(&(b.1 / b.0.least)))?;
        Some((e.case, worst.0, worst.1))
    };
    let finalists: Vec<(usize, Pair, f64)> = ranked.iter().take(tuning().experiment.finalists).filter_map(refitted).collect();
    let rate = |f: &(usize, Pair, f64)| f.2 * f.2 / (cases[f.0].trial.seconds() + tuning().experiment.setting_up);
    let best = finalists.iter().filter(|f| f.2 >= f.1.least).max_by(|a, b| rate(a).total_cmp(&rate(b)));
    let Some((case, pair, separation)) = best.copied() else {
        return planner.with_sensor(rivals, &cases, separable[0], finalists.iter().map(|f| f.2).fold(0.0, f64::max));
    };
    let inseparable = all.iter().copied().find(|p| !separable.contains(p));
    Ok(planner.separating(rivals, &cases[case], pair, separation, inseparable))
}

/// The effects that a structure adds, sorted, so that their order does not matter.
fn ids(structure: &Structure) -> Vec<&str> {
    let mut all: Vec<&str> = structure.added.iter().map(|h| h.id.as_str()).collect();
    all.sort_unstable();
    all
}

/// Separation of two rivals when each is refitted to the prediction of the other, standard deviations; infinite where the budget is used up.
fn refitted(setup: &Setup, rivals: &[Rival], trial: &Trial, Pair { a, b, directed, .. }: Pair) -> f64 {
    if setup.budget.is_over() {
        return f64::INFINITY;
    }
    let unit = rivals[a].unit.max(rivals[b].unit);
    let ways = if directed { vec![(a, b)] } else { vec![(a, b), (b, a)] };
    let left = ways.into_par_iter().map(|(one, other)| rivals[one].refit(setup, trial, &rivals[other]).unwrap_or(0.0));
    (left.reduce(|| f64::INFINITY, f64::min) / unit).sqrt()
}
