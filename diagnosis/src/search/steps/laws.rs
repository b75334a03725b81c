//! Every law at the place of the best: where one law helps another one may be the right one.

use super::step::Step;
use crate::search::race::{Seed, distinct};
use crate::search::state::State;
use crate::tuning::tuning;

/// Other laws at the place of the best.
pub(crate) struct Laws;

impl Step for Laws {
    fn name(&self) -> &'static str {
        "fitting other laws at the same place"
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let (course, coupled_first, samples) = (state.course, state.is_coupled(), state.samples());
        // Coupled to the measured motion, what is far from the noise was tried already.
        let best = state.found.first().filter(|c| !coupled_first || c.fit.cost < tuning().noise.near * samples as f64);
        let mut seeds = best.map_or_else(Vec::new, |best| course.laws(&best.structure, &best.fit.values));
        if !coupled_first {
            let own = |s: &Seed| -> f64 {
                let promised = |h: &usize| state.tried.iter().find(|t| t.id == course.hypotheses[*h].id).map_or(0.0, |t| t.promised);
                s.effects.iter().map(|(h, _)| promised(h)).sum()
            };
            seeds.sort_by(|a, b| own(b).total_cmp(&own(a)));
            distinct(&mut seeds);
            seeds.truncate(tuning().search.laws_uncoupled);
        }
        seeds
    }
}
