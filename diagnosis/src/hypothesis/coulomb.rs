//! Dry friction of one level.

use super::Physics;
use super::builder::{ElementBuilder, even};
use super::sites::SET_VALUED;

pub(super) const PHYSICS: Physics = Physics {
    name: "coulomb",
    family: "friction",
    contains: &[],
    propose: |sites| {
        // Also beside presliding friction: where two rub, one may slip at once.
        let places = sites.pairs.iter().filter(|site| !sites.has(site, &SET_VALUED));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let f = site.force;
            Some(new.number("force", even(0.0, 20.0 * f, 0.0)).starts(vec![vec![0.05 * f], vec![0.3 * f]]))
        };
        places.filter_map(one).collect()
    },
};
