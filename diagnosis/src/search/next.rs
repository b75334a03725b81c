//! Which structures are tried beside those that were found.

use super::view::{SIMPLE, View};
use super::{Candidate, candidate, distinct_structures};
use crate::fit::{Effort, Evaluator};
use crate::hypothesis::{self, Hypothesis, Place};
use crate::physics;
use crate::race::{Course, Seed};
use crate::screen::{Promise, Screen};
use crate::structure::Structure;
use crate::work::Steps;
use std::collections::HashSet;

/// Share of what promises most that a law has to promise, where a stated number is to give back what it may have taken on.
const PROMISED: f64 = 0.5;
/// Parts of a stated number that it may have taken on.
const TAKEN_ON: [f64; 3] = [0.25, 0.5, 0.9];
/// Times the least value of a number in logarithms below which it has all but vanished.
const VANISHED: f64 = 2.0;
/// How many structures get back numbers that have vanished.
const REVIVED: usize = 3;
/// Times the cost of the best up to which a law that is drawn coarsely may win when drawn more finely.
const COARSELY: f64 = 3.0;

impl Course<'_> {
    /// Laws of one number that promise something, beside a stated number of the same kind that has a body in common with them and that gives back what it
    /// may have taken on. A damper at a motor and one at the drum behind a stiff cable do nearly the same: a fit goes from all at one to all at the other along
    /// a narrow valley, and not to its end. `chance` is the share that the best promises by chance.
    pub(super) fn given_back(&self, promises: &[Promise], chance: f64) -> Vec<Seed> {
        let problem = self.evaluator.problem;
        let top = promises.first().map_or(0.0, |p| p.share);
        let (stated, of_records) = (
            self.nominal.structure.stated_of(problem, &self.nominal.fit.values),
            self.nominal.structure.of_records(&self.nominal.fit.values),
        );
        let mut used = HashSet::new();
        let mut seeds = Vec::new();
        for promise in promises.iter().filter(|p| p.share > chance.max(PROMISED * top) && used.insert(p.hypothesis)) {
            let Some(law) = self.hypotheses.get(promise.hypothesis) else { continue };
            let (Place::Between(a, b), [parameter]) = (&law.place, law.parameters.as_slice()) else { continue };
            for element in problem.model.elements.iter().filter(|e| e.law.kind().name == law.physics.name) {
                let ends = element.between.map(|end| problem.model.place_name(end));
                let path = format!("elements.{}.{}", element.name, parameter.key);
                let own = problem.stated.iter().zip(&stated).enumerate().find(|(_, (s, _))| s.path == path);
                let Some((index, (number, value))) = own.filter(|_| ends.iter().any(|end| end == a || end == b)) else { continue };
                let moved = (value - number.given).max(0.0);
                for taken in TAKEN_ON.iter().map(|part| part * value).chain((moved > 0.0).then_some(moved)) {
                    let mut stated = stated.clone();
                    stated[index] = (value - taken).clamp(number.range.0, number.range.1);
                    let values = vec![taken.clamp(parameter.range.0, parameter.range.1)];
                    seeds.push(Seed { effects: vec![(promise.hypothesis, values)], stated, of_records: of_records.clone(), guided: false });
                }
            }
        }
        seeds
    }

    /// Simpler laws of the same family in the place of each effect of the best; where something is left to explain, laws that are as simple, too.
    pub(super) fn relatives(&self, found: &[Candidate], done: bool) -> Vec<Seed> {
        let Some(best) = found.first() else { return Vec::new() };
        let own = self.effects_of(&best.structure, &best.fit.values);
        let mut seeds = Vec::new();
        for (out, (effect, values)) in best.structure.added.iter().zip(best.structure.added_of(&best.fit.values)).enumerate() {
            let relative = |h: &Hypothesis| {
                h.place.same(&effect.place)
                    && h.physics.family == effect.physics.family
                    && h.id != effect.id
                    && h.parameters.len() < effect.parameters.len() + if done { 0 } else { 2 }
            };
            for (index, h) in self.hypotheses.iter().enumerate().filter(|(_, h)| relative(h)) {
                for start in hypothesis::starts_beside(effect, &values, h) {
                    let mut effects = own.clone();
                    if let Some(slot) = effects.get_mut(out) {
                        *slot = (index, start);
                        seeds.push(Seed::beside(self.evaluator.problem, (&best.structure, &best.fit.values), effects, false));
                    }
                }
            }
        }
        seeds
    }

    /// Each effect with its values at every other place where that physics may be: to first order neighbours that are firmly joined do the same, and
    /// screening, or a path along which they are led, may have taken one for the other.
    pub(super) fn elsewhere(&self, best: &Candidate) -> Vec<Seed> {
        let own = self.effects_of(&best.structure, &best.fit.values);
        let mut seeds = Vec::new();
        for (slot, (effect, values)) in best.structure.added.iter().zip(best.structure.added_of(&best.fit.values)).enumerate() {
            let beside = |h: &Hypothesis| best.structure.added.iter().enumerate().all(|(i, other)| i == slot || other.compatible(h));
            for (index, h) in self.hypotheses.iter().enumerate() {
                if h.physics != effect.physics || h.place.same(&effect.place) || !beside(h) {
                    continue;
                }
                let alike =
                    h.parameters.len() == values.len() && h.parameters.iter().zip(&effect.parameters).all(|(a, b)| a.unit == b.unit);
                let carried: Vec<f64> = h.parameters.iter().zip(&values).map(|(p, v)| v.clamp(p.range.0, p.range.1)).collect();
                let start = if alike { Some(carried) } else { h.starts.first().cloned() };
                let Some(start) = start else { continue };
                let mut effects = own.clone();
                if let Some(place) = effects.get_mut(slot) {
                    *place = (index, start);
                    seeds.push(Seed::beside(self.evaluator.problem, (&best.structure, &best.fit.values), effects, false));
                }
            }
        }
        seeds
    }

    /// The best, and what does nearly as well with as many effects, where some of their numbers have all but vanished, and where to start: with a mass
    /// shared with the neighbour that took it on, where no mass is gone with the other numbers as given. Searched in logarithms, a number near 0 moves
    /// nothing any more, so that a fit that took a body's mass away does not give it back.
    pub(super) fn revived(&self, found: &[Candidate]) -> Vec<(Structure, Vec<f64>)> {
        let problem = self.evaluator.problem;
        let Some(best) = found.first() else { return Vec::new() };
        let near = |c: &&Candidate| c.fit.cost < COARSELY * best.fit.cost;
        let mut all = Vec::new();
        for c in distinct_structures(found, best.structure.added.len()).filter(near).take(REVIVED) {
            let mut stated = c.structure.stated_of(problem, &c.fit.values);
            let mut gone: Vec<usize> =
                (0..stated.len()).filter(|i| problem.stated[*i].log && stated[*i] < VANISHED * problem.stated[*i].range.0).collect();
            // A damper or a spring may vanish beside a law that was found; a body does not.
            let is_mass = |i: &usize| problem.stated[*i].path.starts_with("bodies.");
            if gone.iter().any(is_mass) {
                gone.retain(is_mass);
            }
            for &i in &gone {
                // Mass that one body lost another has taken on: the two share it as they did.
                match self.heir(&stated, i) {
                    Some(heir) => {
                        let (own, other) = (problem.stated[i].given, problem.stated[heir].given);
                        let both = stated[i] + stated[heir];
                        (stated[i], stated[heir]) = (both * own / (own + other), both * other / (own + other));
                    }
                    None => stated[i] = problem.stated[i].given,
                }
            }
            if !gone.is_empty() {
                let added = c.structure.added_of(&c.fit.values);
                all.push((c.structure.clone(), c.structure.values(problem, &stated, &added, &c.structure.of_records(&c.fit.values))));
            }
        }
        all
    }

    /// Of the bodies joined to one whose mass is a stated number, the number of the mass that has grown most.
    fn heir(&self, stated: &[f64], gone: usize) -> Option<usize> {
        let problem = self.evaluator.problem;
        let body = problem.stated[gone].path.strip_prefix("bodies.")?;
        let name = |end| problem.model.place_name(end);
        let joined = |other: &str| {
            problem.model.elements.iter().any(|e| e.between.map(name).contains(&body) && e.between.map(name).contains(&other))
        };
        let growth = |i: &usize| stated[*i] / problem.stated[*i].given;
        let others = (0..stated.len()).filter(|i| *i != gone && problem.stated[*i].path.strip_prefix("bodies.").is_some_and(joined));
        others.filter(|i| growth(i) > 1.0).max_by(|a, b| growth(a).total_cmp(&growth(b)))
    }

    /// The best with each of its effects left out, where there is more than one, or as a simpler law that it contains, and where to start: from where all
    /// else is.
    pub(super) fn fewer(&self, found: &[Candidate]) -> Vec<(Structure, Vec<f64>)> {
        let problem = self.evaluator.problem;
        let Some(best) = found.first() else { return Vec::new() };
        let (stated, of_records) = (best.structure.stated_of(problem, &best.fit.values), best.structure.of_records(&best.fit.values));
        let own: Vec<(Hypothesis, Vec<f64>)> =
            best.structure.added.iter().cloned().zip(best.structure.added_of(&best.fit.values)).collect();
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
            for law in self.hypotheses.iter().filter(simpler) {
                let Some(start) = hypothesis::starts_beside(effect, values, law).into_iter().next() else { continue };
                let start = hypothesis::inherited(law, &start, effect, values);
                let mut effects = own.clone();
                effects[out] = (law.clone(), start);
                all.push(made(effects));
            }
        }
        all
    }

    /// The best, and what does nearly as well with as many effects, with a law of theirs drawn more finely.
    pub(super) fn finer(&self, found: &[Candidate]) -> Vec<Seed> {
        let Some(best) = found.first() else { return Vec::new() };
        let near = |c: &&Candidate| c.fit.cost < COARSELY * best.fit.cost;
        let mut seeds = Vec::new();
        for c in distinct_structures(found, best.structure.added.len()).filter(near) {
            let own = self.effects_of(&c.structure, &c.fit.values);
            for (slot, (effect, values)) in c.structure.added.iter().zip(c.structure.added_of(&c.fit.values)).enumerate() {
                for (index, h) in self.hypotheses.iter().enumerate() {
                    let Some(start) = hypothesis::refined(effect, &values, h) else { continue };
                    let mut effects = own.clone();
                    if let Some(place) = effects.get_mut(slot) {
                        *place = (index, start);
                        seeds.push(Seed::beside(self.evaluator.problem, (&c.structure, &c.fit.values), effects, false));
                    }
                }
            }
        }
        seeds
    }

    /// A structure with each of what promises most beside it added.
    pub(super) fn extensions(&self, view: &View, base: &Candidate, count: usize) -> Vec<Seed> {
        let problem = self.evaluator.problem;
        let fit = if view.whole {
            Some(base.fit.clone())
        } else {
            view.evaluator.fit(&base.structure, &base.fit.values, Effort { steps: 4, tolerance: 2.0 })
        };
        let Some(fit) = fit else { return Vec::new() };
        let fits = |h: usize| {
            let new = &self.hypotheses[h];
            new.parameters.len() <= SIMPLE && base.structure.added.iter().all(|b| b.compatible(new))
        };
        let own = self.effects_of(&base.structure, &fit.values);
        let seed = |p: Promise, guided| {
            Seed::beside(problem, (&base.structure, &fit.values), [own.clone(), vec![(p.hypothesis, p.values)]].concat(), guided)
        };
        let mut used = HashSet::new();
        let next = view.screen.look(&fit, &fits).into_iter().filter(|p| used.insert(p.hypothesis));
        next.take(count).map(|p| seed(p, view.guided)).collect()
    }

    /// A structure with each of what promises most added, screened beside it: an offset shows as one only where the spring behind it is bent, a law
    /// at low speed only where the friction at speed is right.
    pub(super) fn anew(&self, evaluator: &Evaluator, base: &Candidate, work: Steps) -> Vec<Seed> {
        let problem = self.evaluator.problem;
        let Some(fit) = evaluator.fit(&base.structure, &base.fit.values, Effort { steps: 4, tolerance: 2.0 }) else { return Vec::new() };
        let screen = Screen::new(evaluator, &base.structure, &fit, self.hypotheses, work);
        let own = self.effects_of(&base.structure, &fit.values);
        let seed = |p: Promise, guided| {
            Seed::beside(problem, (&base.structure, &fit.values), [own.clone(), vec![(p.hypothesis, p.values)]].concat(), guided)
        };
        let fits = |h: usize| self.hypotheses[h].parameters.len() <= SIMPLE;
        let mut used = HashSet::new();
        let next = screen.look(&fit, &fits).into_iter().filter(|p| used.insert(p.hypothesis));
        next.take(6).map(|p| seed(p, false)).collect()
    }

    /// A structure with each of its effects exchanged for what promises most in its place.
    pub(super) fn exchanges(&self, view: &View, best: &Candidate, count: usize) -> Vec<Seed> {
        let problem = self.evaluator.problem;
        let stated = best.structure.stated_of(problem, &best.fit.values);
        let values = best.structure.added_of(&best.fit.values);
        let of_records = best.structure.of_records(&best.fit.values);
        let mut seeds = Vec::new();
        for out in 0..best.structure.added.len() {
            let keep = |i: &usize| *i != out;
            let added: Vec<Hypothesis> = (0..values.len()).filter(keep).map(|i| best.structure.added[i].clone()).collect();
            let kept: Vec<Vec<f64>> = (0..values.len()).filter(keep).map(|i| values[i].clone()).collect();
            let structure = Structure::new(problem, &problem.fit, added);
            let start = structure.values(problem, &stated, &kept, &of_records);
            let Some(fit) = view.evaluator.fit(&structure, &start, Effort { steps: 3, tolerance: 2.0 }) else { continue };
            seeds.extend(self.extensions(view, &candidate(&view.evaluator, structure, fit), count));
        }
        seeds
    }

    pub(crate) fn effects_of(&self, structure: &Structure, values: &[f64]) -> Vec<(usize, Vec<f64>)> {
        let place = |h: &Hypothesis| self.hypotheses.iter().position(|other| other.id == h.id);
        structure.added.iter().zip(structure.added_of(values)).filter_map(|(h, v)| Some((place(h)?, v))).collect()
    }
}
