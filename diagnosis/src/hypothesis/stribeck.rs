//! Dry friction that falls with speed.

use super::Physics;
use super::builder::{ElementBuilder, Freedom, log, replaced_friction};
use super::sites::FRICTION;

pub(super) const PHYSICS: Physics = Physics {
    name: "stribeck",
    family: "friction",
    contains: &["coulomb"],
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, v) = (site.force, site.speed);
            let (new, stated) = match sites.first_of(site, &FRICTION) {
                None => (new, (0.1 * f, Some(0.0))),
                Some((_, e)) if e.law.kind().name == "stribeck" => return None,
                Some((index, e)) => (new.replacing(index), replaced_friction(&e.law)),
            };
            let (c, neutral) = stated;
            let level = Freedom { range: (0.0, 20.0 * f.max(c)), neutral, log: false };
            let starts = vec![vec![c, 1.6 * c, 0.1 * v], vec![0.8 * c, 1.5 * c, 0.5 * v], vec![c, 1.6 * c, 0.02 * v]];
            let new = new.number("coulomb", level).number("static", level).number("velocity", log(1e-4 * v, 3.0 * site.speed_peak));
            Some(new.tidy(|values| values[1][0] = values[1][0].max(values[0][0])).starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
