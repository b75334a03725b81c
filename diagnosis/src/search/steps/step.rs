//! The properties that a step of a search declares.

use crate::search::race::Seed;
use crate::search::state::State;
use crate::tuning::tuning;

/// How structures are fitted at first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Race {
    /// Coupled to the measured motion, where the nominal model is far from the noise.
    Coupled,
    /// Not coupled.
    Free,
    /// Not coupled, with as many substeps as the residual of the best asks for.
    Finer,
    /// Not coupled, with as many substeps as it takes to see where bodies meet.
    Finest,
}

/// On which terms the structures of a step are fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Terms {
    /// Share of the work that they may take where the best is far from the noise and another effect may be what is missing.
    pub share: f64,
    /// Whether they may take no more than that near the noise, too.
    pub is_capped: bool,
    /// Share of the whole work at which their fits end, where that is not the schedule's.
    pub ends: Option<f64>,
    /// How they are fitted at first.
    pub race: Race,
    /// Whether structures that were tried before are tried again, from other values.
    pub tries_again: bool,
}

impl Terms {
    /// Of effects that may be what is missing.
    pub fn effects() -> Terms {
        Terms { share: tuning().search.share_of_effects, is_capped: false, ends: None, race: Race::Coupled, tries_again: false }
    }

    /// Of the best in another form, from where it is.
    pub fn forms_of_the_best(share: f64) -> Terms {
        Terms { share, is_capped: false, ends: None, race: Race::Free, tries_again: true }
    }

    /// Of rivals that the best has to win over.
    pub fn rivals() -> Terms {
        let search = &tuning().search;
        Terms { ends: Some(search.rivals_end), ..Terms::forms_of_the_best(search.share_of_relatives) }
    }
}

/// A step of a search.
pub(crate) trait Step {
    /// What it does, as progress and explanation say it.
    fn name(&self) -> &'static str;

    /// On which terms its structures are fitted.
    fn terms(&self) -> Terms {
        Terms::effects()
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
