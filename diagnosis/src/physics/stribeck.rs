//! Dry friction that falls with speed.

use crate::hypothesis::builder::{ElementBuilder, Freedom, log};
use crate::hypothesis::{Against, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "stribeck",
    family: Family::Friction,
    words: "dry friction with stiction (Stribeck)",
    size: "static",
    proportional: false,
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::NearRest,
    twin: None,
    sliding: &["coulomb"],
    from_level: &["coulomb", "static"],
    memory: false,
    holds: false,
    refine: |_, _, _| None,
    contains: &["coulomb"],
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, v) = (site.force, site.speed);
            let (new, stated) = match sites.dry_friction(site) {
                None => (new, (0.1 * f, Some(0.0))),
                Some(there) if there.kind == PHYSICS.name => return None,
                Some(there) => (new.replacing(there.index), (there.level, there.neutral())),
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
