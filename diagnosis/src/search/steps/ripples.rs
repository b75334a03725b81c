//! Ripples that stand alone in the spectrum of their force.

use super::step::{Race, Step, Terms};
use crate::search::race::Seed;
use crate::search::state::State;
use crate::tuning::tuning;

/// Coupled to the measured motion a ripple slides out of phase, so these are fitted without.
pub(crate) struct Ripples;

impl Step for Ripples {
    fn name(&self) -> &'static str {
        "fitting ripples"
    }

    fn terms(&self) -> Terms {
        Terms { race: Race::Free, ..Terms::effects() }
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        // Without a coupling they are among the single effects.
        if !state.is_coupled() {
            return Vec::new();
        }
        let course = state.course;
        let beside = (&course.nominal.structure, &course.nominal.fit.values[..]);
        let seed = |ripple: &(usize, Vec<f64>)| Seed::beside(course.evaluator.problem, beside, vec![ripple.clone()], false);
        state.ripples.iter().take(tuning().search.ripples).map(seed).collect()
    }
}
