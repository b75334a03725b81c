//! In which order steps are taken, and how much work each may do: the only place that decides either.

use super::journal::Outcome;
use super::state::State;
use super::steps::{
    BesideTheBest, Exchanges, Finer, FromNominal, Grown, Laws, More, MorePairs, OneParameter, OtherPlaces, Pairs, Race, Relatives,
    RestoredDefaults, Richer, Ripples, Scans, Singles, Split, Step,
};
use crate::options::Options;
use crate::output_error::candidate::key_of;
use crate::search::race::{Course, distinct};
use crate::tuning::tuning;
use std::collections::HashSet;

/// The steps of a search for so many effects, in their order. Where the residual is noise, only what may be wrong with single effects is asked.
fn steps(is_quiet: bool, effects: usize) -> Vec<&'static dyn Step> {
    let mut steps: Vec<&'static dyn Step> = vec![
        &Ripples,
        &Singles::NEXT,
        &OneParameter,
        &RestoredDefaults,
        &Split::ALONE,
        &Scans,
        &Laws,
        &Singles::NEXT,
        &OneParameter,
        &FromNominal,
        &Relatives,
        &OtherPlaces,
        &Relatives,
    ];
    if is_quiet {
        return steps;
    }
    steps.extend([
        &Finer as &dyn Step,
        &Pairs,
        &Relatives,
        &Relatives,
        &Split::BESIDE,
        &Laws,
        &Exchanges,
        &Richer,
        &Singles::REST,
        &MorePairs,
        &Laws,
        &Exchanges,
        &OtherPlaces,
    ]);
    for _ in 2..effects {
        steps.extend([&More as &dyn Step, &Split::BESIDE, &Scans, &BesideTheBest, &Exchanges]);
    }
    steps.extend([&OtherPlaces as &dyn Step, &Relatives]);
    steps
}

/// A step as a table shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRow {
    /// What it does.
    pub name: &'static str,
    /// Share of the work that it may take where the best is far from the noise.
    pub share: f64,
}

/// The steps of a search for three effects in their order, each where it comes first.
pub fn table() -> Vec<StepRow> {
    let mut rows: Vec<StepRow> = Vec::new();
    for step in steps(false, 3) {
        let row = StepRow { name: step.name(), share: step.terms().share };
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    rows
}

/// The steps where the motion is known and what it takes is compared: effects add up in the force, so each is looked for beside those before.
fn steps_along_the_motion(effects: usize) -> Vec<&'static dyn Step> {
    let mut steps: Vec<&'static dyn Step> = vec![&Ripples, &Singles::NEXT, &OneParameter, &Scans, &Relatives];
    for _ in 1..effects {
        steps.extend([&Grown as &dyn Step, &Relatives, &Scans]);
    }
    steps.extend([&Relatives as &dyn Step, &Finer, &Exchanges, &Pairs, &Laws, &Relatives, &OtherPlaces, &Relatives]);
    steps
}

/// Takes all steps, as far as there is work to be done and something left to explain.
pub(super) fn run(state: &mut State, options: &Options, report: &(dyn Fn(&str) + Sync)) {
    let effects = options.effects_of_one_axis();
    let is_turned = state.course.evaluator.problem.inverse.is_some();
    let steps = if is_turned && !state.is_quiet() { steps_along_the_motion(effects) } else { steps(state.is_quiet(), effects) };
    for step in steps {
        let outcome = match hindrance(step, state) {
            Some(hindrance) => hindrance,
            None => {
                report(step.name());
                take(step, state)
            }
        };
        state.note(step.name(), outcome);
    }
}

/// Why a step is not begun; `None` where nothing hinders it.
fn hindrance(step: &dyn Step, state: &mut State) -> Option<Outcome> {
    let is_for_rivals = step.is_for_rivals(state);
    if !is_for_rivals && state.is_done() {
        return Some(Outcome::ResidualIsWhite);
    }
    if state.work.is_past(if is_for_rivals { tuning().search.last_rival } else { tuning().search.last_step }) {
        state.left_out |= !state.is_done();
        return Some(Outcome::NoWorkLeft);
    }
    (!step.is_wanted(state)).then_some(Outcome::NothingNew)
}

/// Fits what a step proposes, and keeps what is worth it.
fn take(step: &dyn Step, state: &mut State) -> Outcome {
    let before = state.work.budget.spent();
    let mut seeds = step.propose(state);
    let terms = step.terms();
    let course = state.course;
    if !terms.tries_again {
        distinct(&mut seeds);
        let known: HashSet<String> = state.found.iter().map(|c| key_of(&c.structure.added)).collect();
        seeds.retain(|s| !known.contains(&key_of(s.effects.iter().map(|(h, _)| &course.hypotheses[*h]))));
    }
    // Where the best leaves much over, another effect may be what is missing: other laws in its place have their share of the work, and no more.
    let share = state.work.share(if state.leaves_much() || terms.is_capped { terms.share } else { 1.0 });
    let budget = terms.ends.map_or_else(|| course.evaluator.budget.clone(), |end| state.work.up_to(end));
    let evaluator = course.evaluator.within(budget.next(share));
    let course = Course { evaluator: &evaluator, ..course };
    let course = match terms.race {
        Race::Coupled => course,
        Race::Free => Course { along: None, ..course },
        Race::Finer => Course { along: None, coarse: state.fine, ..course },
        Race::Finest => Course { along: None, coarse: tuning().search.scan_substeps, ..course },
    };
    let proposed = seeds.len();
    let raced = course.race(seeds);
    let fitted = raced.len();
    state.take(raced);
    step.settle(state);
    Outcome::Taken { proposed, fitted, work: state.work.budget.spent() - before }
}
