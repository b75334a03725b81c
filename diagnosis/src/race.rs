//! Many structures, fitted a little each; the better ones more, the best to their end.

use crate::candidate::{Candidate, candidate, key_of};
use crate::effort::Effort;
use crate::fit::{Evaluator, Fit};
use crate::hypothesis::Hypothesis;
use crate::problem::{Problem, Record};
use crate::screen::worst_records;
use crate::structure::{Role, Structure};
use crate::tuning::tuning;
use backdrive_plant::set::Initial;
use std::collections::HashSet;

/// A structure to be fitted: its hypotheses, where each starts, and the stated numbers to start from.
#[derive(Debug, Clone)]
pub struct Seed {
    /// Places in the list of hypotheses, with values to start from.
    pub effects: Vec<(usize, Vec<f64>)>,
    /// Stated numbers to start from.
    pub stated: Vec<f64>,
    /// Numbers of single records to start from.
    pub of_records: Vec<(Role, f64)>,
    /// Whether it was found along the measured path, and is to be fitted there first.
    pub guided: bool,
}

impl Seed {
    /// Effects beside the other numbers of a fit.
    pub fn beside(problem: &Problem, (base, values): (&Structure, &[f64]), effects: Vec<(usize, Vec<f64>)>, guided: bool) -> Seed {
        let (stated, of_records) = (base.stated_of(problem, values), base.of_records(values));
        Seed { effects, stated, of_records, guided }
    }

    /// What sets a structure apart, whatever its values.
    fn key(&self) -> (Vec<usize>, bool) {
        let mut key: Vec<usize> = self.effects.iter().map(|e| e.0).collect();
        key.sort_unstable();
        (key, self.guided)
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
    /// What fits that start far off are held against first, led along the recordings, and the nominal model fitted so.
    pub along: Option<(&'a Evaluator<'a>, &'a Candidate)>,
    /// All hypotheses.
    pub hypotheses: &'a [Hypothesis],
    /// The nominal model refitted.
    pub nominal: &'a Candidate,
    /// The stated numbers as given.
    pub given: &'a [f64],
    /// Substeps per sample of the first steps, at most.
    pub coarse: usize,
}

impl Course<'_> {
    /// Fits all seeds a little, `keep[0]` of them more, and `keep[1]` to their end.
    pub fn race(&self, seeds: Vec<Seed>, keep: [usize; 2]) -> Vec<Candidate> {
        let (evaluator, problem) = (self.evaluator, self.evaluator.problem);
        // The first steps on the recordings that are explained worst, with few substeps.
        let few = worst_records(evaluator, &self.nominal.fit.residuals, 2);
        let whole = few.len() == evaluator.records.len()
            || problem.initial == Initial::Free
            || !problem.unknown.is_empty()
            || problem.fit.iter().any(|r| !r.conditions.is_empty());
        let some: Vec<Record> = if whole { problem.fit.clone() } else { few.iter().map(|r| problem.fit[*r].clone()).collect() };
        let coarse = Evaluator { substeps: self.coarse, records: &some, widest: 1.0, ..evaluator.clone() };
        let nominal_there = if whole { self.nominal.fit.clone() } else { restricted(evaluator, &self.nominal.fit, &few) };
        let entries = self.entries(&seeds, keep[0] + 2);
        let begun = evaluator.budget.abreast(&entries, |budget, (structure, starts)| {
            let coarse = coarse.within(budget.clone());
            // Along the path the numbers have moved far from where the nominal model's derivatives hold.
            let known = if self.along.is_some() { None } else { Some((&self.nominal.structure, &nominal_there)) };
            let effort = tuning().fit.first;
            let starts = starts.iter().cloned().map(|start| {
                let problem = evaluator.problem;
                let numbers = (structure.stated_of(problem, &start), structure.added_of(&start));
                let anew = || structure.values(problem, &numbers.0, &numbers.1, &self.nominal.structure.of_records(&nominal_there.values));
                // Along the measured path, and on parts of recordings, next to nothing is known of an unknown curve.
                let start = if problem.unknown.is_empty() { start } else { anew() };
                own_first(&coarse, Some((&self.nominal.structure, &nominal_there)), structure, start)
            });
            let fits = starts.filter_map(|start| coarse.fit_knowing(structure, &start, effort, known));
            let best = fits.min_by(|a, b| hopeful(a).total_cmp(&hopeful(b)))?;
            Some((structure.clone(), best))
        });
        let mut running: Vec<(Structure, Fit)> = begun.into_iter().flatten().flatten().collect();
        let middle =
            Evaluator { substeps: tuning().fit.middle_substeps.max(self.coarse), widest: tuning().fit.widest_midway, ..evaluator.clone() };
        let stages = [
            (if self.along.is_some() { 0 } else { keep[0] + 4 }, &coarse, tuning().fit.early),
            (keep[0], &middle, tuning().fit.middle),
            (keep[1], evaluator, tuning().fit.late),
        ];
        for (stage, (count, held_against, effort)) in stages.into_iter().enumerate().filter(|(_, s)| s.0 > 0) {
            running.sort_by(|a, b| hopeful(&a.1).total_cmp(&hopeful(&b.1)));
            distinct_fits(&mut running);
            // Once one is near its end, those far behind have no chance.
            let best = running.first().map_or(0.0, |(_, f)| hopeful(f));
            let floor = running.first().map_or(0.0, |(_, f)| f.residuals.len() as f64);
            let margin =
                if best < tuning().search.best_at_noise * floor { tuning().search.behind_at_noise } else { tuning().search.behind_far };
            let mut place = 0..;
            running.retain(|(_, f)| {
                place.next() < Some(tuning().search.always)
                    || hopeful(f) < margin * best.max(floor)
                    || best > tuning().search.behind_far * floor
            });
            // Far from the noise there is more to come: nothing is decided by the last steps.
            if stage == 2 && best > tuning().noise.near * floor {
                break;
            }
            // In the last stage those behind are kept as they are: they are rivals, if beaten ones.
            let rest = if stage == 2 { running.split_off(count.min(running.len())) } else { Vec::new() };
            running.truncate(count);
            let lead = running.first().map_or(0.0, |(_, f)| hopeful(f));
            let next = evaluator.budget.abreast(&running, |budget, (structure, fit)| {
                // Beside one that leaves nothing over, others only have to show that they do no better; those far behind have.
                let beaten = stage == 2 && lead < tuning().search.best_ends * floor && hopeful(fit) > lead;
                if beaten && hopeful(fit) > margin * lead {
                    return None;
                }
                let effort = if beaten { Effort { steps: tuning().fit.beaten_steps, ..effort } } else { effort };
                held_against.within(budget.clone()).fit_knowing(structure, &fit.values, effort, Some((structure, fit)))
            });
            for ((_, fit), next) in running.iter_mut().zip(next) {
                if let Some(next) = next.flatten() {
                    *fit = next;
                }
            }
            running.extend(rest);
        }
        let size = evaluator.len();
        running
            .into_iter()
            .filter(|(_, f)| f.residuals.len() == size && f.cost.is_finite())
            .map(|(s, f)| candidate(evaluator, s, f))
            .collect()
    }

    /// The effects of a structure by their places in the list of hypotheses, with their values.
    pub(crate) fn effects_of(&self, structure: &Structure, values: &[f64]) -> Vec<(usize, Vec<f64>)> {
        let place = |h: &Hypothesis| self.hypotheses.iter().position(|other| other.id == h.id);
        structure.added.iter().zip(structure.added_of(values)).filter_map(|(h, v)| Some((place(h)?, v))).collect()
    }
}

/// A start whose curves of unknown inputs are fitted beside the rest of it, with derivatives that another fit knows: a law begins beside a hand that
/// goes with it, and not with what was found without it.
pub(crate) fn own_first(evaluator: &Evaluator, known: Option<(&Structure, &Fit)>, structure: &Structure, start: Vec<f64>) -> Vec<f64> {
    if evaluator.problem.unknown.is_empty() {
        return start;
    }
    let only = Evaluator { own_only: true, ..evaluator.clone() };
    only.fit_knowing(structure, &start, tuning().fit.of_records, known).map_or(start, |fit| fit.values)
}

/// Keeps the first fit of each structure.
pub(crate) fn distinct_fits(fits: &mut Vec<(Structure, Fit)>) {
    let mut names = HashSet::new();
    fits.retain(|(structure, _)| names.insert(key_of(&structure.added)));
}

/// A fit's residuals and derivatives on some of its recordings.
fn restricted(evaluator: &Evaluator, fit: &Fit, records: &[usize]) -> Fit {
    let layout = evaluator.layout();
    let pick = |all: &Vec<f64>| -> Vec<f64> {
        layout.iter().filter(|l| records.contains(&l.0)).filter_map(|l| all.get(l.2.clone())).flatten().copied().collect()
    };
    Fit { residuals: pick(&fit.residuals), jacobian: fit.jacobian.iter().map(pick).collect(), ..fit.clone() }
}

/// What a fit would cost if most of what its next step foresees came true.
pub fn hopeful(fit: &Fit) -> f64 {
    fit.cost - fit.foreseen.min(tuning().search.may_gain * fit.cost)
}
