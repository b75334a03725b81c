//! Viscous friction.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "damper",
    family: Family::Damping,
    words: "viscous friction",
    size: "damping",
    against: Against::Velocity,
    state: State::WithItsVariable,
    mark: Mark::Viscous,
    facts: Facts { proportional: true, contains: &["back_emf"], ..Facts::NONE },
    propose: |sites| {
        let places = sites.pairs.iter().filter(|site| !sites.has(site, &["damper", "asymmetric_damper", "backlash"]));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let b = site.force / site.speed;
            Some(new.number("damping", even(0.0, 1000.0 * b, 0.0)).starts(vec![vec![0.05 * b], vec![0.5 * b]]))
        };
        places.filter_map(one).collect()
    },
};
