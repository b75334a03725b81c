//! A law of many parameters that replaces the best.

use super::step::Step;
use crate::hypothesis::{Family, Hypothesis};
use crate::output_error::candidate::distinct_structures;
use crate::search::race::Seed;
use crate::search::state::State;

/// Physics of many parameters come in where simpler relatives do not suffice.
pub(crate) struct Richer;

impl Step for Richer {
    fn name(&self) -> &'static str {
        "fitting richer laws"
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let Some(view) = state.views.first() else { return Vec::new() };
        // In the place of what is the best of its kind.
        let best = distinct_structures(&state.found, 1).next().map(|c| &c.structure.added[0]);
        let like = |h: &Hypothesis| {
            best.is_some_and(|b| b.place.same(&h.place) && matches!(b.physics.family, Family::Friction | Family::Hysteresis))
        };
        let rich = view.rich.iter().find(|p| like(&state.course.hypotheses[p.hypothesis]));
        rich.map(|p| view.seed(vec![(p.hypothesis, p.values.clone())])).into_iter().collect()
    }
}
