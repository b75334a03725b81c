//! What a step of a search says of itself.

use crate::race::Seed;
use crate::search::state::State;

/// How structures are fitted at first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Race {
    /// Coupled to the measured motion, where the nominal model is far from the noise.
    Coupled,
    /// Not coupled.
    Free,
    /// Not coupled, with as many substeps as the residual of the best asks for.
    Finer,
}

/// A step of a search.
pub(crate) trait Step {
    /// What it does, as progress and explanation say it.
    fn name(&self) -> &'static str;

    /// Share of the work that it may take where the best is far from the noise and another effect may be what is missing.
    fn share(&self) -> f64 {
        1.0
    }

    /// Share of the whole work at which its fits end, where that is not the schedule's.
    fn ends(&self) -> Option<f64> {
        None
    }

    /// How its structures are fitted at first.
    fn race(&self) -> Race {
        Race::Coupled
    }

    /// Whether structures that were tried before are tried again, from other values.
    fn tries_again(&self) -> bool {
        false
    }

    /// Whether it is for rivals of the best: they are wanted however small its residual is.
    fn is_for_rivals(&self, _state: &State) -> bool {
        false
    }

    /// Whether it has anything new to propose.
    fn is_wanted(&self, _state: &State) -> bool {
        true
    }

    /// The structures it wants fitted, with values to start from.
    fn propose(&self, state: &mut State) -> Vec<Seed>;

    /// What follows when they are fitted.
    fn settle(&self, _state: &mut State) {}
}
