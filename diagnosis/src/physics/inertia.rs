//! Inertia of a body in excess of the model's value.

use crate::hypothesis::builder::{even, inertia, stated};
use crate::hypothesis::sites::{Reach, Site};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "inertia",
    family: Family::Inertia,
    words: "additional inertia",
    size: "inertia",
    against: Against::Acceleration,
    state: State::WithItsVariable,
    mark: Mark::Mass,
    facts: Facts {
        proportional: true,
        twin: Some("inertia and an inerter to ground are the same force: weigh the body to separate them"),
        contains: &["inerter"],
        ..Facts::NONE
    },
    propose: |sites| {
        let bodies = sites.pairs.iter().filter(|s| s.reach == Reach::Ground);
        let one = |site: &Site| {
            let body = site.ends[0]?;
            let own = sites.model.bodies[body].inertia;
            let typical = site.force / site.acceleration;
            let name = &site.between[0];
            let same = (own > 0.0).then(|| format!("bodies.{name}")).or_else(|| stated(sites.model, body, "inerter", "inertance"));
            let room = even(0.0, 100.0 * typical.max(own), 0.0);
            Some(inertia(sites, &PHYSICS, name, room, &[0.1 * typical, typical]).same_as(same))
        };
        bodies.filter_map(one).collect()
    },
};
