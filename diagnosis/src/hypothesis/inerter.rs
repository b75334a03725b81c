//! Force from relative acceleration: a flywheel behind a gear, fluid that is moved between two chambers.

use super::Physics;
use super::builder::{ElementBuilder, even};
use super::sites::Reach;

pub(super) const PHYSICS: Physics = Physics {
    name: "inerter",
    family: "inertia",
    // To ground it is added inertia, which `inertia` proposes.
    contains: &["inertia"],
    propose: |sites| {
        let places = sites.pairs.iter().filter(|site| site.reach != Reach::Ground && !sites.has(site, &["inerter"]));
        let one = |site: &super::sites::Site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let m = site.force / site.acceleration;
            Some(new.number("inertance", even(0.0, 100.0 * m, 0.0)).starts(vec![vec![0.05 * m], vec![0.5 * m]]))
        };
        places.filter_map(one).collect()
    },
};
