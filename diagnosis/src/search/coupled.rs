//! The first part of a race, coupled to the measured motion. Simulations are short there and one step of a fit goes far. The residual separates laws that a
//! free simulation does not separate until everything else is right.

use crate::hypothesis::{Hypothesis, Place, inherited};
use crate::output_error::effort::Effort;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::Structure;
use crate::output_error::work::{Budget, Steps};
use crate::search::race::{Course, Entry, Seed, distinct_fits, own_first, predicted_cost};
use crate::tuning::tuning;

impl Course<'_> {
    /// Structures to fit and where from. Where fits are coupled to the measured motion, all are fitted so first, and only so many go on.
    pub(crate) fn entries(&self, seeds: &[Seed], count: usize) -> Vec<Entry> {
        if self.along.is_none() {
            return seeds.iter().map(|seed| self.entry(seed)).collect();
        }
        let mut begun = self.rank_and_go_on(self.first_steps(seeds, None), count);
        // Where one law helps another one may be the right one: the places first, then the laws.
        if begun.first().is_some_and(|(_, f)| predicted_cost(f) > tuning().noise.complete * f.residuals.len() as f64) {
            let mut places: Vec<Vec<&Place>> = Vec::new();
            let mut laws = Vec::new();
            for (structure, fit) in &begun {
                let at: Vec<&Place> = structure.added.iter().map(|h| &h.place).collect();
                if places.len() < tuning().search.places && !places.contains(&at) {
                    laws.extend(self.ranked_laws(structure, &fit.values));
                    places.push(at);
                }
            }
            laws.sort_by_key(|(rank, _)| *rank);
            let laws: Vec<Seed> = laws.into_iter().map(|(_, seed)| seed).collect();
            begun.extend(self.first_steps(&laws, Some(tuning().search.laws)));
            begun = self.rank_and_go_on(begun, count);
        }
        begun = self.loosen(begun, count);
        // What shows best on a free simulation may show little where it is coupled, and several effects may show there nearly as well.
        let others = seeds.iter().filter(|s| !s.coupled_first).take(tuning().search.uncoupled).map(|seed| self.entry(seed));
        begun.into_iter().map(|(structure, fit)| (structure, vec![fit.values])).chain(others).collect()
    }

    fn entry(&self, seed: &Seed) -> Entry {
        let problem = self.evaluator.problem;
        let added = seed.effects.iter().map(|(h, _)| self.hypotheses[*h].clone()).collect();
        let structure = Structure::new(problem, &problem.fit, added);
        let values: Vec<Vec<f64>> = seed.effects.iter().map(|(_, v)| v.clone()).collect();
        let mut starts = vec![structure.values(problem, &seed.stated, &values, &seed.of_records)];
        if seed.effects.len() == 1 && !seed.coupled_first {
            starts.push(structure.values(problem, self.given, &values, &seed.of_records));
        }
        (structure, starts)
    }

    /// One step of each, as far as there is time.
    fn first_steps(&self, seeds: &[Seed], work: Option<Steps>) -> Vec<(Structure, Fit)> {
        let Some((coupled, base)) = self.along else { return Vec::new() };
        let budget = &self.evaluator.budget;
        let budget = work.map_or_else(|| budget.clone(), |work| budget.next(work));
        let begun = budget.abreast(seeds, |budget, seed| {
            let coupled = coupled.within(budget.clone());
            let (structure, starts) = self.entry(seed);
            let known = Some((&base.structure, &base.fit));
            let start = own_first(&coupled, known, &structure, starts.first()?.clone());
            let fit = coupled.fit_from_derivatives(&structure, &start, tuning().fit.first_coupled, known)?;
            Some((structure, fit))
        });
        begun.into_iter().flatten().flatten().collect()
    }

    /// More steps of fewer; in the end so many, best first.
    fn rank_and_go_on(&self, mut begun: Vec<(Structure, Fit)>, count: usize) -> Vec<(Structure, Fit)> {
        let Some((coupled, _)) = self.along else { return begun };
        for (keep, steps) in [3 * count, 2 * count, count + 2].into_iter().zip(tuning().fit.coupled_steps) {
            rank(&mut begun, keep);
            let effort = Effort { steps, ..tuning().fit.first_coupled };
            self.go_on(&mut begun, |budget, structure, fit| {
                coupled.within(budget).fit_from_derivatives(structure, &fit.values, effort, Some((structure, fit)))
            });
        }
        rank(&mut begun, count);
        begun
    }

    /// The same with a looser coupling: the residual is less and less the force at hand, more and more the simulation error.
    fn loosen(&self, mut begun: Vec<(Structure, Fit)>, count: usize) -> Vec<(Structure, Fit)> {
        let Some((coupled, _)) = self.along else { return begun };
        let coupling = coupled.coupling.as_ref().map(|g| g.with(tuning().coupling.looser * g.strength));
        let coupled = Evaluator { coupling, ..coupled.clone() };
        let effort = tuning().fit.early;
        self.go_on(&mut begun, |budget, structure, fit| coupled.within(budget).fit(structure, &fit.values, effort));
        rank(&mut begun, count);
        begun
    }

    /// Fits go on side by side; those that cannot stay as they are.
    pub(crate) fn go_on<'b>(&'b self, fits: &mut [(Structure, Fit)], next: impl Fn(Budget<'b>, &Structure, &Fit) -> Option<Fit> + Sync) {
        let nexts = self.evaluator.budget.abreast(fits, |budget, (structure, fit)| next(budget.clone(), structure, fit));
        for ((_, fit), next) in fits.iter_mut().zip(nexts) {
            if let Some(next) = next.flatten() {
                *fit = next;
            }
        }
    }

    /// Every law at the place of each effect of a structure, the others as they are; first starts first.
    pub(crate) fn laws(&self, structure: &Structure, values: &[f64]) -> Vec<Seed> {
        let mut seeds = self.ranked_laws(structure, values);
        seeds.sort_by_key(|(rank, _)| *rank);
        seeds.into_iter().map(|(_, seed)| seed).collect()
    }

    /// The same with the place of each start among those of its law.
    fn ranked_laws(&self, structure: &Structure, values: &[f64]) -> Vec<(usize, Seed)> {
        let own = self.effects_of(structure, values);
        let mut seeds: Vec<(usize, Seed)> = Vec::new();
        for (slot, (effect, own_values)) in structure.added.iter().zip(structure.added_of(values)).enumerate() {
            let beside = |h: &Hypothesis| structure.added.iter().enumerate().all(|(i, other)| i == slot || other.compatible(h));
            for (index, h) in self.hypotheses.iter().enumerate() {
                if !h.place.same(&effect.place) || h.id == effect.id || !beside(h) {
                    continue;
                }
                let same = h.starts.first().map(|s| inherited(h, s, effect, &own_values)).filter(|s| !h.starts.contains(s));
                for (rank, start) in same.into_iter().chain(h.starts.iter().cloned()).enumerate() {
                    let mut effects = own.clone();
                    if let Some(place) = effects.get_mut(slot) {
                        *place = (index, self.with_replaced((structure, values), h, start));
                        seeds.push((rank, Seed::beside(self.evaluator.problem, (structure, values), effects, true)));
                    }
                }
            }
        }
        seeds
    }
}

/// The best of each structure, best first, without those that are far behind; at most so many.
fn rank(begun: &mut Vec<(Structure, Fit)>, keep: usize) {
    begun.sort_by(|a, b| predicted_cost(&a.1).total_cmp(&predicted_cost(&b.1)));
    distinct_fits(begun);
    let best = begun.first().map_or(0.0, |(_, f)| predicted_cost(f).max(f.residuals.len() as f64));
    // One that is still on its way is not behind yet, if its next step foresees that it comes near.
    let on_its_way = |f: &Fit| f.cost - f.predicted_decrease.min(tuning().search.may_gain_coupled * f.cost);
    begun.retain(|(_, f)| on_its_way(f) < tuning().search.behind * best);
    begun.truncate(keep);
}
