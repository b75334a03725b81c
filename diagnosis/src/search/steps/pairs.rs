//! Pairs of effects.

use super::extensions::extensions;
use super::step::{Keep, Step};
use crate::candidate::distinct_structures;
use crate::race::Seed;
use crate::search::state::State;

/// The pairs that promise most together, and the best singles with what promises most beside them.
pub(crate) struct Pairs;

impl Step for Pairs {
    fn name(&self) -> &'static str {
        "fitting pairs"
    }

    fn keep(&self) -> Keep {
        Keep { further: 5, to_the_end: 3 }
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        state.effects = 2;
        let (course, found) = (state.course, &state.found);
        let Some(view) = state.views.first() else { return Vec::new() };
        let mut seeds: Vec<Seed> = state.views.iter().flat_map(|view| view.pairs(course.hypotheses, 5)).collect();
        for base in distinct_structures(found, 1).take(3) {
            seeds.extend(extensions(&course, view, base, 4));
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

    fn keep(&self) -> Keep {
        Keep { further: 5, to_the_end: 3 }
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let (course, found) = (state.course, &state.found);
        let Some(view) = state.views.first() else { return Vec::new() };
        distinct_structures(found, 1).take(5).flat_map(|base| extensions(&course, view, base, 7)).collect()
    }
}
