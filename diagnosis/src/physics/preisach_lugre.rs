//! Bristle friction with non-local memory.

use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

/// A name that verdicts and `--without` know, without hypotheses of its own. `maxwell_slip` has the same memory with its parameters free, and the result of
/// a search with both as rivals has not been measured.
pub(super) const PHYSICS: Physics = Physics {
    name: "preisach_lugre",
    family: Family::Friction,
    words: "presliding hysteresis (Preisach)",
    size: "coulomb",
    against: Against::Displacement,
    state: State::Reversals,
    mark: Mark::Memory,
    facts: Facts {
        sliding: &["coulomb"],
        from_level: &["coulomb", "static"],
        memory: true,
        contains: &["lugre", "dahl", "stribeck", "coulomb"],
        ..Facts::NONE
    },
    propose: |_| Vec::new(),
};
