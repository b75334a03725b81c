//! Friction of a gear or screw in proportion to the force that it passes on.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "gear_loss",
    family: Family::Friction,
    words: "a loss proportional to the transmitted force",
    size: "efficiency",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::Other,
    // It has no level of its own: without load there is no loss.
    facts: Facts::NONE,
    propose: |sites| {
        let places = sites.near().filter(|site| sites.is_loaded(site) && !sites.has(site, &["gear_loss", "load_friction"]));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let new = new.number("efficiency", even(0.05, 1.0, 1.0)).number("back_efficiency", even(-2.0, 1.0, 1.0));
            Some(new.starts(vec![vec![0.9, 0.9], vec![0.7, 0.55]]))
        };
        places.filter_map(one).collect()
    },
};
