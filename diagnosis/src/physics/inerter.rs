//! Force from relative acceleration: a flywheel behind a gear, fluid that is moved between two chambers.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::sites::{Reach, Site};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "inerter",
    family: Family::Inertia,
    words: "an inertance",
    size: "inertance",
    against: Against::Acceleration,
    state: State::WithItsVariable,
    mark: Mark::Mass,
    facts: Facts {
        twin: Some("inertia and an inerter to ground are the same force: weigh the body to separate them"),
        // To ground it is added inertia, which `inertia` proposes.
        contains: &["inertia"],
        ..Facts::NONE
    },
    propose: |sites| {
        let places = sites.pairs.iter().filter(|site| site.reach != Reach::Ground && !sites.has(site, &["inerter"]));
        let one = |site: &Site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let m = site.force / site.acceleration;
            Some(new.number("inertance", even(0.0, 100.0 * m, 0.0)).starts(vec![vec![0.05 * m], vec![0.5 * m]]))
        };
        places.filter_map(one).collect()
    },
};
