//! Many structures, fitted a little each; the better ones more, the best to their end.

use crate::hypothesis::{Hypothesis, Parameter};
use crate::output_error::candidate::{Candidate, candidate, key_of};
use crate::output_error::effort::Effort;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::{Role, Structure};
use crate::output_error::work::Steps;
use crate::recordings::problem::{Problem, Record};
use crate::search::beginnings::Beginnings;
use crate::tuning::tuning;
use rayon::prelude::*;
use std::collections::HashSet;

/// A structure to be fitted: its hypotheses, where each starts, and the stated parameters to start from.
#[derive(Debug, Clone)]
pub struct Seed {
    /// Places in the list of hypotheses, with values to start from.
    pub effects: Vec<(usize, Vec<f64>)>,
    /// Stated parameters to start from.
    pub stated: Vec<f64>,
    /// Parameters of single records to start from.
    pub of_records: Vec<(Role, f64)>,
    /// Whether it was found coupled to the measured motion, and is to be fitted there first.
    pub coupled_first: bool,
}

impl Seed {
    /// Effects beside the other parameters of a fit.
    pub fn beside(problem: &Problem, (base, values): (&Structure, &[f64]), effects: Vec<(usize, Vec<f64>)>, coupled_first: bool) -> Seed {
        let (stated, of_records) = (base.stated_of(problem, values), base.of_records(values));
        Seed { effects, stated, of_records, coupled_first }
    }

    /// The structure on some recordings, and where it starts.
    pub(crate) fn begin(&self, course: &Course, records: &[Record]) -> (Structure, Vec<f64>) {
        let problem = course.evaluator.problem;
        let added = self.effects.iter().filter_map(|(h, _)| course.hypotheses.get(*h).cloned()).collect();
        let values: Vec<Vec<f64>> = self.effects.iter().map(|(_, v)| v.clone()).collect();
        let structure = Structure::new(problem, records, added);
        let start = structure.values(problem, &self.stated, &values, &self.of_records);
        (structure, start)
    }

    /// What sets a structure apart, whatever its values.
    fn key(&self) -> (Vec<usize>, bool) {
        let mut key: Vec<usize> = self.effects.iter().map(|e| e.0).collect();
        key.sort_unstable();
        (key, self.coupled_first)
    }
}

/// Drops seeds whose structure came before.
pub fn distinct(seeds: &mut Vec<Seed>) {
    let mut seen = HashSet::new();
    seeds.retain(|s| seen.insert(s.key()));
}

/// What structures are fitted against, and from where.
#[derive(Clone, Copy)]
pub struct Course<'a> {
    /// The recordings.
    pub evaluator: &'a Evaluator<'a>,
    /// What fits that start far off are held against first: simulations coupled to the measured motion, and the nominal model fitted so.
    pub along: Option<(&'a Evaluator<'a>, &'a Candidate)>,
    /// All hypotheses.
    pub hypotheses: &'a [Hypothesis],
    /// The nominal model refitted.
    pub nominal: &'a Candidate,
    /// The stated parameters as given.
    pub given: &'a [f64],
    /// Substeps per sample of the first steps, at most.
    pub coarse: usize,
}

/// A structure and values to start from.
pub(crate) type Entry = (Structure, Vec<Vec<f64>>);

/// A structure and where its fit stands.
type Running = (Structure, Fit);

/// How well the best of a race fits.
#[derive(Clone, Copy)]
struct Lead {
    /// Its predicted cost.
    cost: f64,
    /// What noise alone would cost.
    noise: f64,
}

impl Lead {
    fn of(running: &[Running]) -> Lead {
        running.first().map_or(Lead { cost: 0.0, noise: 0.0 }, |(_, f)| Lead { cost: predicted_cost(f), noise: f.residuals.len() as f64 })
    }

    /// Cost over the best's up to which others have a chance.
    fn margin(&self) -> f64 {
        let search = &tuning().search;
        if self.cost < tuning().noise.complete * self.noise { search.behind_at_noise } else { search.behind_far }
    }
}

impl Course<'_> {
    /// What first steps from a fit are held against, and how much simulations there may err.
    pub(crate) fn beginnings(&self, residuals: &[f64]) -> Beginnings {
        Beginnings::of_the_worst(self.evaluator, residuals)
    }

    /// Fits all seeds a little, some of them more, and fewer to their end.
    pub fn race(&self, seeds: Vec<Seed>) -> Vec<Candidate> {
        let (evaluator, further) = (self.evaluator, tuning().search.further);
        // The first steps on parts of the recordings, with few substeps.
        let beginnings = self.beginnings(&self.nominal.fit.residuals);
        let some = beginnings.records(evaluator);
        let coarse = Evaluator { substeps: self.coarse, records: &some, widest: 1.0, ..evaluator.clone() };
        let nominal_there = beginnings.restricted(evaluator, &self.nominal.fit);
        let entries = self.entries(&seeds, further + 2);
        let mut running = self.begun(&entries, &coarse, &nominal_there);
        let substeps = evaluator.problem.middle_substeps().max(self.coarse);
        let middle = Evaluator { substeps, widest: tuning().fit.widest_midway, ..evaluator.clone() };
        let early = if self.along.is_some() { 0 } else { further + 4 };
        for (count, held_against, effort) in [(early, &coarse, tuning().fit.early), (further, &middle, tuning().fit.middle)] {
            if count > 0 {
                drop_those_behind(&mut running);
                running.truncate(count);
                self.go_on(&mut running, |budget, structure, fit| {
                    held_against.within(budget).fit_from_derivatives(structure, &fit.values, effort, Some((structure, fit)))
                });
            }
        }
        drop_those_behind(&mut running);
        // Far from the noise there is more to come: nothing is decided by the last steps.
        if Lead::of(&running).cost <= tuning().noise.near * Lead::of(&running).noise {
            self.fit_to_the_end(&mut running, tuning().search.ended);
        }
        let size = evaluator.len();
        // Where the work ended before all recordings were looked at, the best so far are what the race gives.
        if !evaluator.budget.is_halted() && running.iter().all(|(_, f)| f.residuals.len() != size) {
            running.truncate(further);
            let whole = Evaluator { budget: evaluator.budget.extended(Steps::MAX), ..evaluator.clone() };
            running.par_iter_mut().for_each(|(structure, fit)| {
                if let Some(there) = whole.fit(structure, &fit.values, Effort { steps: 0, tolerance: 1.0 }) {
                    *fit = there;
                }
            });
        }
        let ended = running.into_iter().filter(|(_, f)| f.residuals.len() == size && f.cost.is_finite());
        ended.map(|(s, f)| candidate(evaluator, s, f)).collect()
    }

    /// The first steps of each: the better of its starts.
    fn begun(&self, entries: &[Entry], coarse: &Evaluator, nominal_there: &Fit) -> Vec<Running> {
        let problem = self.evaluator.problem;
        let nominal = (&self.nominal.structure, nominal_there);
        // Coupled fits have moved far from where the nominal model's derivatives hold.
        let known = if self.along.is_some() { None } else { Some(nominal) };
        let begun = self.evaluator.budget.abreast(entries, |budget, (structure, starts)| {
            let coarse = coarse.within(budget.clone());
            let starts = starts.iter().cloned().map(|start| {
                let numbers = (structure.stated_of(problem, &start), structure.added_of(&start));
                let anew = || structure.values(problem, &numbers.0, &numbers.1, &self.nominal.structure.of_records(&nominal_there.values));
                // Coupled to the measured motion, and on parts of recordings, next to nothing is known of an unknown input.
                let start = if problem.unknown.is_empty() { start } else { anew() };
                own_first(&coarse, Some(nominal), structure, start)
            });
            let fits = starts.filter_map(|start| coarse.fit_from_derivatives(structure, &start, tuning().fit.first, known));
            let best = fits.min_by(|a, b| predicted_cost(a).total_cmp(&predicted_cost(b)))?;
            Some((structure.clone(), best))
        });
        begun.into_iter().flatten().flatten().collect()
    }

    /// The last stage: the best `count` structures are fitted to their ends. Those behind are not changed: they are rivals, if beaten ones.
    fn fit_to_the_end(&self, running: &mut Vec<Running>, count: usize) {
        let (lead, effort) = (Lead::of(running), tuning().fit.to_the_end);
        let rest = running.split_off(count.min(running.len()));
        let is_beaten = |fit: &Fit| lead.cost < tuning().noise.complete * lead.noise && predicted_cost(fit) > lead.cost;
        self.go_on(running, |budget, structure, fit| {
            // Beside one that leaves noise, others only have to show that they do no better; those far behind have.
            if is_beaten(fit) && predicted_cost(fit) > lead.margin() * lead.cost {
                return None;
            }
            let steps = if is_beaten(fit) { tuning().fit.beaten_steps } else { effort.steps };
            self.evaluator.within(budget).fit_from_derivatives(structure, &fit.values, Effort { steps, ..effort }, Some((structure, fit)))
        });
        running.extend(rest);
    }

    /// A start of a law that replaces elements of the model, with their parameters from a fit. The law's own starts have those of an early refit, and
    /// another effect may have moved the parameters far from these.
    pub(crate) fn with_replaced(&self, (structure, values): (&Structure, &[f64]), law: &Hypothesis, start: Vec<f64>) -> Vec<f64> {
        let problem = self.evaluator.problem;
        let of_replaced = |path: &str| law.replaces.iter().any(|name| path.starts_with(&format!("elements.{name}.")));
        let fitted = structure.stated_of(problem, values);
        let replaced: Vec<(Option<String>, f64)> = (problem.stated.iter().zip(fitted))
            .filter(|(s, _)| of_replaced(&s.path))
            .map(|(s, value)| (problem.model.unit_at(&s.path).ok(), value))
            .collect();
        let one = |(parameter, start): (&Parameter, f64)| {
            // Where it has no effect of its own it does what the element did.
            let is_of_element = parameter.neutral == Some(start);
            let same = replaced.iter().find(|(unit, _)| is_of_element && unit.as_ref() == Some(&parameter.unit));
            same.map_or(start, |(_, fitted)| fitted.clamp(parameter.range.0, parameter.range.1))
        };
        law.parameters.iter().zip(start).map(one).collect()
    }

    /// The effects of a structure by their places in the list of hypotheses, with their values.
    pub(crate) fn effects_of(&self, structure: &Structure, values: &[f64]) -> Vec<(usize, Vec<f64>)> {
        let place = |h: &Hypothesis| self.hypotheses.iter().position(|other| other.id == h.id);
        structure.added.iter().zip(structure.added_of(values)).filter_map(|(h, v)| Some((place(h)?, v))).collect()
    }
}

/// A start whose curves of unknown inputs are fitted to the rest of it, with derivatives that another fit knows. A law then begins with a hand that is
/// consistent with it, not with the hand that was found without it.
pub(crate) fn own_first(evaluator: &Evaluator, known: Option<(&Structure, &Fit)>, structure: &Structure, start: Vec<f64>) -> Vec<f64> {
    if evaluator.problem.unknown.is_empty() {
        return start;
    }
    let only = Evaluator { own_only: true, ..evaluator.clone() };
    only.fit_from_derivatives(structure, &start, tuning().fit.early, known).map_or(start, |fit| fit.values)
}

/// Best first, each structure once, without those that have no chance against the best.
fn drop_those_behind(running: &mut Vec<Running>) {
    running.sort_by(|a, b| predicted_cost(&a.1).total_cmp(&predicted_cost(&b.1)));
    distinct_fits(running);
    let lead = Lead::of(running);
    let is_open = lead.cost > tuning().search.behind_far * lead.noise;
    let mut place = 0..;
    running.retain(|(_, f)| {
        place.next() < Some(tuning().search.always) || predicted_cost(f) < lead.margin() * lead.cost.max(lead.noise) || is_open
    });
}

/// Keeps the first fit of each structure.
pub(crate) fn distinct_fits(fits: &mut Vec<(Structure, Fit)>) {
    let mut names = HashSet::new();
    fits.retain(|(structure, _)| names.insert(key_of(&structure.added)));
}

/// What a fit would cost if most of what its next step foresees came true.
pub fn predicted_cost(fit: &Fit) -> f64 {
    fit.cost - fit.predicted_decrease.min(tuning().search.may_gain * fit.cost)
}
