//! One more effect.

use super::extensions::extensions;
use super::step::Step;
use crate::output_error::candidate::distinct_structures;
use crate::search::race::Seed;
use crate::search::state::State;
use crate::tuning::tuning;

/// The best with one effect fewer, and what promises most beside them.
pub(crate) struct More;

impl Step for More {
    fn name(&self) -> &'static str {
        "fitting more effects at once"
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        state.effects += 1;
        let (bases, beside) = (tuning().search.bases[0], tuning().search.beside[0]);
        let (course, found) = (state.course, &state.found);
        let Some(view) = state.views.first() else { return Vec::new() };
        distinct_structures(found, state.effects - 1).take(bases).flat_map(|base| extensions(&course, view, base, beside)).collect()
    }
}
