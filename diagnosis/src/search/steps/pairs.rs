//! Pairs of effects.

use super::extensions::extensions;
use super::step::Step;
use crate::output_error::candidate::distinct_structures;
use crate::search::race::Seed;
use crate::search::state::State;
use crate::tuning::tuning;

/// The pairs that promise most together, and the best singles with what promises most beside them.
pub(crate) struct Pairs;

impl Step for Pairs {
    fn name(&self) -> &'static str {
        "fitting pairs"
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        state.effects = 2;
        let (bases, beside) = (tuning().search.bases[0], tuning().search.beside[0]);
        let (course, found) = (state.course, &state.found);
        let Some(view) = state.views.first() else { return Vec::new() };
        let mut seeds: Vec<Seed> = state.views.iter().flat_map(|view| view.pairs(course.hypotheses, beside)).collect();
        for base in distinct_structures(found, 1).take(bases) {
            seeds.extend(extensions(&course, view, base, beside));
        }
        seeds
    }
}

/// More singles with more of what promises most beside them.
pub(crate) struct MorePairs;

impl Step for MorePairs {
    fn name(&self) -> &'static str {
        "fitting more pairs"
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let (bases, beside) = (tuning().search.bases[1], tuning().search.beside[1]);
        let (course, found) = (state.course, &state.found);
        let Some(view) = state.views.first() else { return Vec::new() };
        distinct_structures(found, 1).take(bases).flat_map(|base| extensions(&course, view, base, beside)).collect()
    }
}
