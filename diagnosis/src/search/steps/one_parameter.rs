//! Laws of one parameter, whatever screening promised of them.

use super::step::Step;
use crate::search::race::Seed;
use crate::search::state::State;

/// Laws of one parameter: to first order they may do no more than the nominal parameters do together.
pub(crate) struct OneParameter;

impl Step for OneParameter {
    fn name(&self) -> &'static str {
        "fitting laws of one parameter"
    }

    fn is_for_rivals(&self, state: &State) -> bool {
        // They are rivals of a best that took more parameters.
        let nominal = state.course.nominal.structure.free.len();
        state.found.first().is_some_and(|c| c.structure.free.len() > nominal + 1)
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        state.one_parameter.by_ref().collect()
    }
}
