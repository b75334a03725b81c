//! Hypotheses screened again with a structure that was found.

use super::step::{Race, Step, Terms};
use crate::hypothesis::Hypothesis;
use crate::output_error::candidate::{Candidate, distinct_structures, simplest_of};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::work::Steps;
use crate::search::race::{Course, Seed};
use crate::search::screen::{Promise, Screen};
use crate::search::state::State;
use crate::tuning::tuning;
use std::collections::HashSet;

/// What only shows beside a law that was found shows little coupled to the motion of the nominal model.
pub(crate) struct BesideTheBest;

impl Step for BesideTheBest {
    fn name(&self) -> &'static str {
        "screening additions to the best"
    }

    fn terms(&self) -> Terms {
        Terms { race: Race::Finer, ..Terms::effects() }
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let (course, samples) = (state.course, state.samples());
        let Some(view) = state.views.first() else { return Vec::new() };
        let fewer = || distinct_structures(&state.found, state.effects - 1);
        let best = fewer().next();
        // The first step to it may have been the wrong one: so from the best without that, too.
        let without = |first: &Hypothesis| fewer().find(|c| c.structure.added.iter().all(|h| h.physics != first.physics));
        let late = state.work.is_past(tuning().search.last_other_base);
        let other = best.and_then(|b| b.structure.added.first()).filter(|_| !late).and_then(without);
        // And far from the noise from what does nearly as well with fewer parameters: it leaves more open.
        let has_fewer = |c: &&Candidate| best.is_some_and(|b| c.structure.free.len() < b.structure.free.len());
        let is_other = |c: &Candidate| other.is_some_and(|o| std::ptr::eq(o, c));
        let plain = simplest_of(fewer(), samples).filter(has_fewer).filter(|c| !is_other(c));
        let mut seeds = Vec::new();
        let mut fine = course.coarse;
        for base in best.into_iter().chain(other).chain(plain) {
            let substeps = substeps_for(&view.evaluator, base);
            fine = fine.max(substeps);
            seeds.extend(screened(
                &course,
                &Evaluator { substeps, ..view.evaluator.clone() },
                base,
                state.work.share(tuning().screening.share_anew),
            ));
        }
        state.fine = fine;
        seeds
    }
}

/// A structure with each of the most promising effects added, screened with that structure as base. An offset shows as one only where the law of the spring
/// behind it is right, a law at low speed only where the friction at speed is right.
fn screened(course: &Course, evaluator: &Evaluator, base: &Candidate, work: Steps) -> Vec<Seed> {
    let problem = course.evaluator.problem;
    let Some(fit) = evaluator.fit(&base.structure, &base.fit.values, tuning().fit.early) else { return Vec::new() };
    let screen = Screen::new(evaluator, &base.structure, &fit, course.hypotheses, work);
    let own = course.effects_of(&base.structure, &fit.values);
    let seed = |p: Promise, coupled_first| {
        Seed::beside(problem, (&base.structure, &fit.values), [own.clone(), vec![(p.hypothesis, p.values)]].concat(), coupled_first)
    };
    let fits = |h: usize| course.hypotheses[h].parameters.len() <= tuning().screening.parameters;
    let mut used = HashSet::new();
    let next = screen.look(&fit, &fits).into_iter().filter(|p| used.insert(p.hypothesis));
    next.take(tuning().search.beside[0]).map(|p| seed(p, false)).collect()
}

/// Fewest substeps per sample with which a simulation errs by less than the residual of a structure.
fn substeps_for(evaluator: &Evaluator, candidate: &Candidate) -> usize {
    let of = |substeps: usize| Evaluator { substeps, ..evaluator.clone() }.residuals(&candidate.structure, &candidate.fit.values);
    let Some(exact) = of(tuning().fit.fine_substeps) else { return evaluator.problem.middle_substeps() };
    let size: f64 = exact.iter().map(|x| x * x).sum();
    let errs = |substeps: &usize| {
        let off = of(*substeps).map_or(f64::INFINITY, |r| r.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b)).sum());
        off > tuning().screening.substep_error * size
    };
    let (coarse, middle) = (evaluator.problem.coarse_substeps(), evaluator.problem.middle_substeps());
    [coarse, middle, 2 * middle, 4 * middle].into_iter().find(|s| !errs(s)).unwrap_or(tuning().fit.fine_substeps)
}
