//! Single effects, those that promise most first: where one of them reaches the noise, the rest have nothing left to explain.

use super::step::Step;
use crate::search::race::Seed;
use crate::search::state::State;
use crate::tuning::tuning;

/// The next of the single effects that screening found promising.
pub(crate) struct Singles {
    name: &'static str,
    /// Whether all that are left are taken.
    all: bool,
}

impl Singles {
    /// The next few.
    pub const NEXT: Singles = Singles { name: "fitting single effects", all: false };
    /// All others.
    pub const REST: Singles = Singles { name: "fitting more single effects", all: true };
}

impl Step for Singles {
    fn name(&self) -> &'static str {
        self.name
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let count = match self.all {
            true => usize::MAX,
            false if state.is_coupled() => tuning().search.singles_coupled,
            false => tuning().search.singles,
        };
        state.singles.by_ref().take(count).collect()
    }
}
