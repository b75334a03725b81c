//! A constant force: gravity, a preload, the mean pull of a cable.

use super::Physics;
use super::builder::{ElementBuilder, even};

pub(super) const PHYSICS: Physics = Physics {
    name: "bias",
    family: "bias",
    contains: &[],
    propose: |sites| {
        let places = sites.near().filter(|site| !sites.has(site, &["bias"]));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let f = site.force;
            Some(new.number("force", even(-10.0 * f, 10.0 * f, 0.0)).starts(vec![vec![0.05 * f], vec![-0.05 * f]]))
        };
        places.filter_map(one).collect()
    },
};
