//! A constant force: gravity, a preload, the mean pull of a cable.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::sites::{Reach, Site};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::{InputKind, Place};

pub(super) const PHYSICS: Physics = Physics {
    name: "bias",
    family: Family::Bias,
    words: "a constant force",
    size: "force",
    against: Against::Time,
    state: State::WithItsVariable,
    mark: Mark::Bias,
    facts: Facts { proportional: true, from_level: &["force"], ..Facts::NONE },
    propose: |sites| {
        // On a body that is moved whatever the force, a constant one is what an offset of the force sensor is.
        let is_moved = |end: &Place| sites.model.inputs.iter().any(|i| i.kind == InputKind::Motion && Some(i.on) == *end);
        let is_free = |site: &&Site| sites.scales.reads_drive || site.reach != Reach::Ground || !site.ends.iter().any(is_moved);
        let places = sites.near().filter(|site| !sites.has(site, &["bias"])).filter(is_free);
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let f = site.force;
            Some(new.number("force", even(-10.0 * f, 10.0 * f, 0.0)).starts(vec![vec![0.05 * f], vec![-0.05 * f]]))
        };
        places.filter_map(one).collect()
    },
};
