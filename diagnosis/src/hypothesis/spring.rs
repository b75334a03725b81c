//! Stiffness where the model has none.

use super::Physics;
use super::builder::{ElementBuilder, even};
use super::sites::ELASTIC;

pub(super) const PHYSICS: Physics = Physics {
    name: "spring",
    family: "stiffness",
    contains: &[],
    propose: |sites| {
        let places = sites.pairs.iter().filter(|site| !sites.has(site, &ELASTIC));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let k = site.force / site.displacement;
            // Negative where a mechanism goes over centre, but not so far that nothing would hold it.
            Some(new.number("stiffness", even(-0.5 * k, 1000.0 * k, 0.0)).starts(vec![vec![0.05 * k], vec![0.5 * k]]))
        };
        places.filter_map(one).collect()
    },
};
