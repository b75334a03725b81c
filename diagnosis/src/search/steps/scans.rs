//! Laws whose misfit has a valley at every few per cent of their size, such as play: from sizes all over the range.

use super::step::{Race, Step, Terms};
use crate::hypothesis::{Family, Hypothesis};
use crate::output_error::candidate::{Candidate, distinct_structures};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::Structure;
use crate::search::race::{Course, Seed, distinct, predicted_cost};
use crate::search::state::State;
use crate::tuning::tuning;

/// A backlash of another size meets its sides at other times, so the misfit of a simulation does not show how far off a size is. The refit of a model
/// without backlash has also moved stiffnesses and inertias far away. So sizes all over the range are tried, with the stated parameters as given and as
/// fitted, firmly coupled to the measured motion. The best are fitted there.
pub(crate) struct Scans;

impl Step for Scans {
    fn name(&self) -> &'static str {
        "scanning sizes of play"
    }

    fn terms(&self) -> Terms {
        Terms { is_capped: true, share: tuning().search.share_of_scans, race: Race::Finest, ..Terms::rivals() }
    }

    fn is_wanted(&self, state: &State) -> bool {
        state.is_coupled() && !state.is_quiet()
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let budget = state.course.evaluator.budget.next(state.work.share(tuning().search.share_of_scans));
        let evaluator = state.course.evaluator.within(budget.clone());
        let course = Course { evaluator: &evaluator, ..state.course };
        let Some(coarse) = firmly(&course) else { return Vec::new() };
        let bases = bases(state, &course);
        let starts: Vec<Seed> = bases.into_iter().flat_map(|base| starts_beside(&course, (&base.structure, &base.fit.values))).collect();
        let costs = budget.abreast(&starts, |budget, seed| {
            let (structure, values) = seed.begin(&course, coarse.records);
            let residuals = coarse.within(budget.clone()).residuals(&structure, &values)?;
            Some((residuals.iter().map(|r| r * r).sum::<f64>(), seed.clone()))
        });
        let best = ranked(costs, tuning().search.scanned);
        let fine = Evaluator { substeps: tuning().search.scan_substeps, ..coarse.clone() };
        let fits = budget.abreast(&best, |budget, (_, seed)| {
            let (structure, values) = seed.begin(&course, fine.records);
            let fit = fine.within(budget.clone()).fit(&structure, &values, tuning().fit.nominal_coupled)?;
            let effects = seed.effects.iter().map(|(h, _)| *h).zip(structure.added_of(&fit.values)).collect();
            let stated = structure.stated_of(course.evaluator.problem, &fit.values);
            Some((predicted_cost(&fit), Seed { effects, stated, ..seed.clone() }))
        });
        // Of a structure the one that is best there: free simulations are no measure before the sides meet at the right times.
        let mut seeds: Vec<Seed> = ranked(fits, usize::MAX).into_iter().map(|(_, seed)| seed).collect();
        distinct(&mut seeds);
        seeds
    }
}

/// Beside what is scanned: the nominal model, with the plain friction and the other single effect that explain most; later what explains most of so many effects less one.
fn bases<'s>(state: &'s State, course: &Course<'s>) -> Vec<&'s Candidate> {
    let so_many = distinct_structures(&state.found, state.effects.max(2) - 1);
    if state.effects > 2 {
        return so_many.take(tuning().search.condensed_bases).collect();
    }
    let singles: Vec<&Candidate> = so_many.collect();
    let is = |c: &Candidate, family: Family| c.structure.added.iter().all(|h| h.physics.family == family);
    let is_plain = |c: &Candidate| c.structure.added.iter().all(|h| h.parameters.len() == 1);
    let friction = singles.iter().find(|c| is(c, Family::Friction) && is_plain(c));
    let other = singles.iter().find(|c| !is(c, Family::Friction) && !is(c, Family::Hysteresis));
    std::iter::once(course.nominal).chain(friction.copied()).chain(other.copied()).collect()
}

/// What scans are held against: recordings to which simulations are coupled so firmly that sides which meet a little later lead nowhere else.
fn firmly<'a>(course: &Course<'a>) -> Option<Evaluator<'a>> {
    let (coupled, _) = course.along?;
    let coupling = coupled.coupling.as_ref().map(|c| c.with(tuning().search.scan_coupling * c.strength));
    Some(Evaluator { coupling, ..coupled.within(course.evaluator.budget.clone()) })
}

/// The least costly, cheapest first.
fn ranked(tried: Vec<Option<Option<(f64, Seed)>>>, most: usize) -> Vec<(f64, Seed)> {
    let mut ranked: Vec<(f64, Seed)> = tried.into_iter().flatten().flatten().collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.truncate(most);
    ranked
}

/// Every scanned law beside a fit, with sizes all over its range, and stated parameters as fitted and as given.
fn starts_beside(course: &Course, (base, fitted): (&Structure, &[f64])) -> Vec<Seed> {
    let own = course.effects_of(base, fitted);
    let (stated, of_records) = (base.stated_of(course.evaluator.problem, fitted), base.of_records(fitted));
    let mut starts = Vec::new();
    for (index, hypothesis) in course.hypotheses.iter().enumerate().filter(|(_, h)| h.is_scanned()) {
        if !base.added.iter().all(|b| b.compatible(hypothesis)) {
            continue;
        }
        for values in sizes(hypothesis) {
            for stated in [course.given, &stated] {
                let effects = [own.clone(), vec![(index, values.clone())]].concat();
                let stated = hypothesis.given_back(&course.evaluator.problem.stated, stated, &values);
                starts.push(Seed { effects, stated, of_records: of_records.clone(), coupled_first: false });
            }
        }
    }
    starts
}

/// Values of a hypothesis with sizes all over its range.
fn sizes(hypothesis: &Hypothesis) -> Vec<Vec<f64>> {
    let Some(place) = hypothesis.parameters.iter().position(|p| p.key == hypothesis.physics.size) else { return Vec::new() };
    let (most, search) = (hypothesis.parameters.get(place).map_or(0.0, |p| p.range.1), &tuning().search);
    let sizes = (0..search.scan_points).map(|i| most * search.scan_ratio.powi(i as i32));
    sizes.flat_map(|size| hypothesis.scanned_from().map(move |start| with(start, place, size))).collect()
}

/// A start with another size.
fn with(start: &[f64], place: usize, size: f64) -> Vec<f64> {
    start.iter().enumerate().map(|(i, x)| if i == place { size } else { *x }).collect()
}
