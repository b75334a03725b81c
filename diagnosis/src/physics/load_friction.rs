//! Dry friction that grows with the load of a joint.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

/// Friction per force of the joint, at most: beyond it a joint locks itself.
const MOST: f64 = 3.0;

pub(super) const PHYSICS: Physics = Physics {
    name: "load_friction",
    family: Family::Friction,
    words: "dry friction that grows with the load",
    size: "coefficient",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::Other,
    facts: Facts {
        sliding: &["force"],
        from_level: &["force"],
        // Without a coefficient it is dry friction of one level.
        contains: &["coulomb"],
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (new, stated) = new.in_place_of_plain_friction(site)?;
            let most = 20.0 * site.force.max(stated.unwrap_or(0.0));
            let c = stated.unwrap_or(0.05 * site.force);
            let new = new.number("force", even(0.0, most, stated.unwrap_or(0.0))).number("coefficient", even(0.0, MOST, 0.0));
            Some(new.starts(vec![vec![0.7 * c, 0.1], vec![0.05 * c, 0.1], vec![c, 0.5]]))
        };
        sites.near().filter(|site| sites.is_loaded(site)).filter_map(one).collect()
    },
};
