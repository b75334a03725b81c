//! Joints with a body in them, started after the model's parameters that absorbed the body are re-initialised.

use super::near::brought_near;
use super::step::{Step, Terms};
use crate::output_error::candidate::{Candidate, distinct_structures};
use crate::output_error::effort::Effort;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::Structure;
use crate::search::race::{Course, Seed, distinct};
use crate::search::screen::Projector;
use crate::search::state::State;
use crate::tuning::tuning;

/// To first order, a compliance in series with a body behind it has the same effect as a softer joint and heavier ends. So screening detects little of it.
/// A fit that starts near the parameters that absorbed the body returns to them. So each joint is split, and the fits start from several frequencies of the
/// body in it.
pub(crate) struct Split {
    name: &'static str,
    /// Whether beside the best effects that were found, else beside the nominal model alone.
    beside: bool,
}

impl Split {
    /// Beside the nominal model.
    pub const ALONE: Split = Split { name: "splitting joints in two", beside: false };
    /// Beside what was found.
    pub const BESIDE: Split = Split { name: "splitting joints in addition to the best", beside: true };
}

impl Step for Split {
    fn name(&self) -> &'static str {
        self.name
    }

    fn terms(&self) -> Terms {
        Terms { is_capped: true, share: tuning().search.share_of_splits, ..Terms::rivals() }
    }

    fn is_for_rivals(&self, state: &State) -> bool {
        // A nominal model at the noise may have absorbed the body.
        !self.beside && !state.may_be_claimed()
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        // Many starts of many joints: what has simpler explanations must not starve for it.
        let budget = state.course.evaluator.budget.next(state.work.share(tuning().search.share_of_splits));
        let evaluator = state.course.evaluator.within(budget);
        let course = Course { evaluator: &evaluator, ..state.course };
        if !self.beside {
            // The stated parameters may be right as they are: then the compliance is beside them, and the refit without it went astray.
            let refitted = course.nominal.structure.stated_of(course.evaluator.problem, &course.nominal.fit.values);
            let mut seeds = split(&course, course.nominal, &refitted, true);
            if state.is_quiet() {
                distinct(&mut seeds);
            } else {
                seeds.extend(split(&course, course.nominal, course.given, false));
            }
            return seeds;
        }
        let problem = course.evaluator.problem;
        let bases = distinct_structures(&state.found, state.effects - 1).take(tuning().search.condensed_bases);
        bases.flat_map(|base| split(&course, base, &base.structure.stated_of(problem, &base.fit.values), true)).collect()
    }
}

/// A start of a structure: the seed, and how much it leaves, to first order with every free parameter adjusted.
type Ranked = (f64, Seed);

/// Each joint of a structure split in two beside these stated parameters, from the starts that leave least.
fn split(course: &Course, base: &Candidate, stated: &[f64], absorbed: bool) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let beginnings = course.beginnings(&base.fit.residuals);
    let records = beginnings.records(course.evaluator);
    let coarse = Evaluator { substeps: course.coarse, records: &records, ..course.evaluator.clone() };
    let there = match absorbed {
        true => beginnings.restricted(course.evaluator, &base.fit).jacobian,
        false => {
            let structure = Structure::new(problem, &records, base.structure.added.clone());
            let own = base.structure.of_records(&base.fit.values);
            let values = structure.values(problem, stated, &base.structure.added_of(&base.fit.values), &own);
            let Some(fit) = coarse.fit(&structure, &values, Effort { steps: 0, ..tuning().fit.first }) else { return Vec::new() };
            fit.jacobian
        }
    };
    let samples = there.first().map_or(0, Vec::len);
    let stride = samples.div_ceil(tuning().screening.residuals).max(1);
    let projector = Projector::new(&there, stride);
    let starts = starts(course, base, stated, absorbed);
    let ranked = course.evaluator.budget.abreast(&starts, |budget, seed| -> Option<Ranked> {
        let (structure, values) = seed.begin(course, &records);
        let mut left: Vec<f64> = coarse.within(budget.clone()).residuals(&structure, &values)?.into_iter().step_by(stride).collect();
        projector.apply(&mut left);
        Some((left.iter().map(|r| r * r).sum(), seed.clone()))
    });
    let mut ranked: Vec<Ranked> = ranked.into_iter().flatten().flatten().collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut used = vec![0; course.hypotheses.len()];
    ranked.retain(|(_, seed)| {
        let Some(count) = seed.effects.last().and_then(|(h, _)| used.get_mut(*h)) else { return false };
        *count += 1;
        *count <= tuning().search.condensed_starts
    });
    let seeds = ranked.into_iter().map(|(_, seed)| seed);
    if absorbed { seeds.collect() } else { brought_near(course, &coarse, seeds.take(tuning().search.condensed_far).collect()) }
}

/// All starts of all joints of a structure.
fn starts(course: &Course, base: &Candidate, stated: &[f64], absorbed: bool) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let own = course.effects_of(&base.structure, &base.fit.values);
    let place = |path: &str| problem.stated.iter().position(|s| s.path == path);
    let is_free =
        |path: &str| !base.structure.added.iter().any(|h| h.replaces.iter().any(|name| path.starts_with(&format!("elements.{name}."))));
    let value = |path: &str| stated.get(place(path)?).copied().filter(|_| is_free(path));
    let mut seeds = Vec::new();
    for (index, hypothesis) in course.hypotheses.iter().enumerate() {
        if !base.structure.added.iter().all(|b| b.compatible(hypothesis)) {
            continue;
        }
        for start in hypothesis.condensed(&problem.model, &value, absorbed) {
            let mut given = stated.to_vec();
            for (path, value) in &start.stated {
                if let Some(at) = place(path)
                    && let Some(slot) = given.get_mut(at)
                {
                    *slot = value.clamp(problem.stated[at].range.0, problem.stated[at].range.1);
                }
            }
            let effects = [own.clone(), vec![(index, start.values)]].concat();
            seeds.push(Seed { effects, stated: given, of_records: base.structure.of_records(&base.fit.values), coupled_first: false });
        }
    }
    seeds
}
