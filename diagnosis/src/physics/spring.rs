//! Stiffness where the model has none.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "spring",
    family: Family::Stiffness,
    words: "a spring",
    size: "stiffness",
    against: Against::Displacement,
    state: State::WithItsVariable,
    mark: Mark::Spring,
    facts: Facts { proportional: true, holds: true, ..Facts::NONE },
    propose: |sites| {
        let places = sites.pairs.iter().filter(|site| sites.holding(site).is_none());
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let k = site.force / site.displacement;
            // Negative where a mechanism goes over centre, but not so far that nothing would hold it.
            Some(new.number("stiffness", even(-0.5 * k, 1000.0 * k, 0.0)).starts(vec![vec![0.05 * k], vec![0.5 * k]]))
        };
        places.filter_map(one).collect()
    },
};
