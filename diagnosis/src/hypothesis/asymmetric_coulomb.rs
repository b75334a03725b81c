//! Dry friction of another level in each direction.

use super::Physics;
use super::builder::{ElementBuilder, even, friction_level};
use super::sites::FRICTION;

pub(super) const PHYSICS: Physics = Physics {
    name: "asymmetric_coulomb",
    family: "friction",
    contains: &["coulomb"],
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let f = site.force;
            let (new, c) = match sites.first_of(site, &FRICTION) {
                None => (new, None),
                Some((index, e)) if e.law.kind().name == "coulomb" => (new.replacing(index), Some(friction_level(&e.law))),
                Some(_) => return None,
            };
            let room = even(0.0, 20.0 * f.max(c.unwrap_or(0.0)), c.unwrap_or(0.0));
            let c = c.unwrap_or(0.1 * f);
            let starts = vec![vec![1.3 * c, 0.7 * c], vec![0.7 * c, 1.3 * c], vec![0.2 * c, 0.1 * c]];
            Some(new.number("positive", room).number("negative", room).starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
