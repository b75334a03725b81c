//! Single effects, those that promise most first: where one of them reaches the noise, the rest have nothing left to explain.

use super::step::{Keep, Step};
use crate::race::Seed;
use crate::search::state::State;

/// The next of the single effects that screening found promising.
pub(crate) struct Singles {
    name: &'static str,
    /// How many where fits begin coupled to the measured motion, which is cheap.
    coupled_first: usize,
    /// How many otherwise.
    free: usize,
    keep: Keep,
}

impl Singles {
    /// The first few.
    pub const FIRST: Singles =
        Singles { name: "fitting single effects", coupled_first: 30, free: 4, keep: Keep { further: 3, to_the_end: 3 } };
    /// The next few.
    pub const NEXT: Singles =
        Singles { name: "fitting single effects", coupled_first: 30, free: 5, keep: Keep { further: 4, to_the_end: 2 } };
    /// All others.
    pub const REST: Singles = Singles {
        name: "fitting more single effects",
        coupled_first: usize::MAX,
        free: usize::MAX,
        keep: Keep { further: 4, to_the_end: 2 },
    };
}

impl Step for Singles {
    fn name(&self) -> &'static str {
        self.name
    }

    fn keep(&self) -> Keep {
        self.keep
    }

    fn propose(&self, state: &mut State) -> Vec<Seed> {
        let count = if state.is_coupled() { self.coupled_first } else { self.free };
        state.singles.by_ref().take(count).collect()
    }
}
