//! Which effects the model lacks: from the nominal model, refitted, to the structures that explain the recordings best.

pub(crate) mod beginnings;
pub(crate) mod coupled;
mod ending;
pub mod excerpts;
mod journal;
mod nominal;
pub mod race;
mod result;
mod schedule;
pub mod screen;
mod share;
mod state;
mod steps;
mod view;

use crate::hypothesis::{Hypothesis, Place};
use crate::options::Options;
use crate::output_error::candidate::{key_of, sort};
use crate::output_error::effort::Effort;
use crate::output_error::error_budget::error_budget;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::hold::evidence;
use crate::output_error::work::{Budget, Limit};
use crate::physics;
use crate::recordings::observer::without_observer;
use crate::recordings::problem::Problem;
use crate::search::excerpts::Excerpts;
use crate::search::race::Course;
use crate::tuning::tuning;
pub use journal::{Entry, Outcome};
use nominal::Nominal;
pub use result::{Detectable, Search, SearchError, Tried};
pub use schedule::{StepRow, table as step_table};
use share::Work;
use state::State;
use std::collections::HashSet;
use view::View;

/// Searches.
///
/// # Errors
/// When the nominal model cannot be simulated on the recordings.
pub fn search(problem: &Problem, options: &Options, limit: Limit, report: &(dyn Fn(&str) + Sync)) -> Result<Search, SearchError> {
    let work = Work { budget: Budget::new(options.work(), limit) };
    let nominal = Nominal::refitted(problem, &work, report)?;
    let (evaluator, refitted) = (&nominal.evaluator, &nominal.refitted);
    let samples = refitted.fit.residuals.len();
    let mut hypotheses = hypotheses_for(&nominal, options);
    report("searching for ripples");
    let ripples = view::ripples(&nominal.seen, &nominal.model, &evaluator.noise_sd, &mut hypotheses);
    report("screening");
    let coupled = &nominal.coupled;
    let seeing = work.share(if nominal.far { tuning().screening.share_far } else { tuning().screening.share_near });
    let base = (&refitted.structure, coupled.fit.clone());
    let mut views = vec![View::of(&coupled.coarse, coupled.parts.as_ref(), base, &hypotheses, seeing, nominal.coupled_first)];
    // Some effects show better on a free simulation; and the refit of a wrong structure may have carried the parameters off, so that
    // without a coupling the given ones are another base.
    let free = Evaluator { coupling: None, ..coupled.coarse.clone() };
    let (from, steps) = if nominal.pulled { (&refitted.fit.values, tuning().fit.nominal_view.steps) } else { (&nominal.start, 0) };
    let other = if nominal.far { free.fit(&refitted.structure, from, Effort { steps, ..tuning().fit.nominal_view }) } else { None };
    let free_parts = other.as_ref().and_then(|fit| Excerpts::of(&free, &refitted.structure, fit, tuning().screening.samples));
    if let Some(fit) = other {
        views.push(View::of(&free, free_parts.as_ref(), (&refitted.structure, fit), &hypotheses, seeing, false));
    }
    let view = &views[0];
    let course = Course {
        evaluator,
        along: nominal.coupled_first.then_some((&view.evaluator, &view.base)),
        hypotheses: &hypotheses,
        nominal: refitted,
        given: &nominal.given,
        coarse: problem.coarse_substeps(),
    };
    let mut tried = promised(&views, &hypotheses);
    let mut state = State::new(course, &views, &tried, &ripples, nominal.far, &work);
    schedule::run(&mut state, options, report);
    let (exhausted, journal) = (state.left_out, std::mem::take(&mut state.journal));
    let mut found = state.found;
    report("fitting the best to convergence");
    ending::make_simpler(&course, &mut found, &work);
    ending::bring_to_their_ends(evaluator, &mut found, refitted, &work);
    let (alone, fewer): (Vec<_>, Vec<_>) =
        ending::taken_back(evaluator, &mut found, &work).into_iter().partition(|(structure, _)| structure.added.is_empty());
    found.extend(ending::polished(evaluator, fewer));
    sort(&mut found, samples);
    let alone: Vec<Vec<f64>> = alone.into_iter().map(|(_, start)| start).collect();
    let mut refitted = ending::nominal_at_its_end(&nominal, &found, &alone, &work);
    let mut seen = HashSet::new();
    found.retain(|c| seen.insert(key_of(&c.structure.added)));
    let unseen_samples = ending::hold_against_unseen(evaluator, &mut found, &mut refitted);
    for t in &mut tried {
        let single = found.iter().find(|c| c.structure.added.len() == 1 && c.structure.added[0].id == t.id);
        t.taken = single.map(|c| 1.0 - c.fit.cost / refitted.fit.cost);
    }
    let holds = evidence(evaluator, &refitted);
    Ok(Search {
        errors: error_budget(evaluator, &refitted, &holds),
        holds,
        noise_sd: evaluator.noise_sd.clone(),
        levels_given: nominal.levels_given.clone(),
        found,
        tried,
        hypotheses: hypotheses.len(),
        samples,
        unseen_samples,
        detectable: view::detectable(view, samples, &hypotheses),
        simulations: work.budget.simulations(),
        work: work.budget.spent(),
        exhausted,
        journal,
        cut: work.budget.was_cut(),
        forces: None,
        nominal: refitted,
    })
}

/// What may be missing: everything that is no stated parameter, each class once.
fn hypotheses_for(nominal: &Nominal, options: &Options) -> Vec<Hypothesis> {
    let problem = nominal.evaluator.problem;
    let withheld: Vec<&str> = options.without.iter().map(String::as_str).collect();
    let mut hypotheses = physics::without(physics::all(&without_observer(&nominal.model), &nominal.scales), &withheld);
    let mut classes = HashSet::new();
    hypotheses.retain(|h| {
        let is_number = h.same_as.as_ref().is_some_and(|path| problem.stated.iter().any(|s| s.path == *path));
        !is_number && !problem.is_unmeasured(&h.place) && classes.insert(h.class.clone())
    });
    without_repeats_at(&problem.standing_bodies(), hypotheses)
}

/// Hypotheses without those between a body that stands still and another, where the same law stands between that one and the ground: no recording separates them.
fn without_repeats_at(standing: &[&str], hypotheses: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let grounded = |place: &Place| match place {
        Place::Between(a, b) if standing.contains(&a.as_str()) && b != "ground" => Some(Place::Between(b.clone(), "ground".to_string())),
        Place::Between(a, b) if standing.contains(&b.as_str()) && a != "ground" => Some(Place::Between(a.clone(), "ground".to_string())),
        Place::Between(..) | Place::Signal(_) => None,
    };
    let is_repeat = |h: &Hypothesis| {
        let other = grounded(&h.place).filter(|_| h.replaces.is_empty());
        other.is_some_and(|place| {
            hypotheses.iter().any(|o| o.physics == h.physics && o.place.same(&place) && o.parameters.len() == h.parameters.len())
        })
    };
    let keeps: Vec<bool> = hypotheses.iter().map(|h| !is_repeat(h)).collect();
    hypotheses.into_iter().zip(keeps).filter_map(|(h, keep)| keep.then_some(h)).collect()
}

/// What screening promised of each, the most first.
fn promised(views: &[View], hypotheses: &[Hypothesis]) -> Vec<Tried> {
    let mut tried: Vec<Tried> = Vec::new();
    for promise in views.iter().flat_map(|v| v.simple.iter().chain(&v.rich)) {
        let id = &hypotheses[promise.hypothesis].id;
        match tried.iter_mut().find(|t| t.id == *id) {
            Some(t) => t.promised = t.promised.max(promise.share),
            None => tried.push(Tried { id: id.clone(), promised: promise.share, taken: None }),
        }
    }
    tried.sort_by(|a, b| b.promised.total_cmp(&a.promised));
    tried
}
