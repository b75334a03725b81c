//! What is claimed of a search, in one word, and what that rests on.

use super::choice::{alike, chosen};
use super::findings::{adequacy, findings};
use super::signals::bursts;
use super::types::{Finding, Word};
use crate::candidate::Candidate;
use crate::evaluator::Evaluator;
use crate::intervals::Uncertainty;
use crate::problem::Problem;
use crate::search::Search;
use crate::statistics::advantage;
use crate::structure::{FreeParameter, Role, Structure};
use crate::tuning::tuning;

/// What is claimed.
pub(super) struct Decision<'s> {
    /// The verdict.
    pub(super) word: Word,
    /// The structure that explains best what it may.
    pub(super) best: &'s Candidate,
    /// How sure its parameters are.
    pub(super) spread: Uncertainty,
    /// What it adds, most important first.
    pub(super) findings: Vec<Finding>,
    /// Structures that cannot be told from it.
    pub(super) alike: Vec<&'s Candidate>,
    /// Times at which a sensor is far off, s.
    pub(super) bursts: Vec<[f64; 2]>,
    /// Whether the model's text is to hold the fitted parameters.
    pub(super) changes: bool,
}

/// Decides.
pub(super) fn decide<'s>(problem: &Problem, search: &'s Search) -> Decision<'s> {
    let best = chosen(search);
    let evaluator = Evaluator { noise_sd: search.noise_sd.clone(), ..Evaluator::new(problem) };
    let spread = Uncertainty::measured(&evaluator, best);
    let at_floor = best.levels.iter().all(|l| *l < tuning().noise.unexplained);
    let nominal_cost = search.nominal.fit.cost;
    let excess = |c: f64| (c / search.samples as f64 - 1.0).max(0.0);
    let explained = 1.0 - excess(best.fit.cost) / excess(nominal_cost).max(1e-12);
    let added = !best.structure.added.is_empty();
    let bursts = bursts(problem, best);
    let alike = alike(search, best);
    let nominal = &search.nominal;
    let off = given_is_off(problem, search) && (added || spread.is_far(nominal, &stated_in(problem, &nominal.structure)));
    let wanders = nominal.whiteness_statistic > tuning().claim.wanders && nominal.levels.iter().any(|l| *l > tuning().noise.at_noise);
    let findings = findings(search, best, &spread, adequacy(best));
    let is_outdone = findings.first().is_some_and(Finding::has_likelier_rival);
    let word = match () {
        () if added && (at_floor || explained > tuning().claim.explained) && (!alike.is_empty() || is_outdone) => Word::Ambiguous,
        () if added && (at_floor || explained > tuning().claim.explained) => Word::Missing,
        () if added => Word::Unexplained,
        () if !bursts.is_empty() => Word::Unexplained,
        () if !at_floor && nominal.correlation_time > tuning().claim.correlated || wanders => Word::Unexplained,
        () if off => Word::Parameters,
        () if !is_excited(problem, search) => Word::CannotTell,
        () => Word::NothingMissing,
    };
    Decision { word, best, spread, findings, alike, bursts, changes: off || added }
}

/// Whether the refitted parameters explain more than the given ones do.
fn given_is_off(problem: &Problem, search: &Search) -> bool {
    let each: Vec<f64> = search.levels_given.clone();
    let total: usize = problem.fit.iter().map(|r| crate::evaluator::measured(r).map(|_| r.len).sum::<usize>()).sum();
    let mut cost = 0.0;
    for record in &problem.fit {
        for output in crate::evaluator::measured(record) {
            cost += each.get(output).map_or(0.0, |l| l * l) * record.len as f64;
        }
    }
    let refit = &search.nominal;
    let numbers = refit.structure.free.len();
    advantage(cost, 0, refit.fit.cost, numbers, total, refit.correlation_time) > 0.0 && refit.fit.cost < tuning().claim.refit_gains * cost
}

/// Where the stated parameters are among a structure's, and what the nominal file says.
fn stated_in(problem: &Problem, structure: &Structure) -> Vec<(usize, f64)> {
    let one = |(place, number): (usize, &FreeParameter)| match number.role {
        Role::Stated(i) => Some((place, problem.stated.get(i)?.given)),
        _ => None,
    };
    structure.free.iter().enumerate().filter_map(one).collect()
}

/// Whether the recordings move the device by more than the measuring error.
fn is_excited(problem: &Problem, search: &Search) -> bool {
    let moves = |(output, noise_sd): (usize, &f64)| {
        problem
            .fit
            .iter()
            .any(|r| r.outputs.get(output).is_some_and(Option::is_some) && r.spread[output] > tuning().claim.excited * noise_sd)
    };
    search.noise_sd.iter().enumerate().any(moves)
}
