//! Drag that rises with the square of speed: a fluid through an orifice.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "quadratic_drag",
    family: Family::Damping,
    words: "quadratic drag",
    size: "coefficient",
    against: Against::Velocity,
    state: State::WithItsVariable,
    mark: Mark::Drag,
    facts: Facts { proportional: true, ..Facts::NONE },
    propose: |sites| {
        let places = sites.near().filter(|site| !sites.has(site, &["quadratic_drag"]));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let q = site.force / (site.speed * site.speed);
            Some(new.number("coefficient", even(0.0, 1000.0 * q, 0.0)).starts(vec![vec![0.05 * q], vec![0.5 * q]]))
        };
        places.filter_map(one).collect()
    },
};
