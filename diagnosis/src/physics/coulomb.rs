//! Dry friction of one level.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "coulomb",
    family: Family::Friction,
    words: "dry friction",
    size: "force",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::Dry,
    facts: Facts { proportional: true, sliding: &["force"], from_level: &["force"], ..Facts::NONE },
    propose: |sites| {
        // Also beside presliding friction: where two rub, one may slip at once.
        let places = sites.pairs.iter().filter(|site| !sites.has_set_valued(site));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let f = site.force;
            Some(new.number("force", even(0.0, 20.0 * f, 0.0)).starts(vec![vec![0.05 * f], vec![0.3 * f]]))
        };
        places.filter_map(one).collect()
    },
};
