//! Dry friction that falls with speed.

use crate::hypothesis::builder::{ElementBuilder, Freedom, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "stribeck",
    family: Family::Friction,
    words: "dry friction with stiction (Stribeck)",
    size: "static",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::NearRest,
    facts: Facts { sliding: &["coulomb"], from_level: &["coulomb", "static"], contains: &["coulomb"], ..Facts::NONE },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, v) = (site.force, site.speed);
            let (new, stated) = new.in_place_of_friction(site)?;
            let (c, neutral) = stated.map_or((0.1 * f, Some(0.0)), |there| (there.level, there.neutral()));
            let level = Freedom { range: (0.0, 20.0 * f.max(c)), neutral, log: false };
            let starts = vec![vec![c, 1.6 * c, 0.1 * v], vec![0.8 * c, 1.5 * c, 0.5 * v], vec![c, 1.6 * c, 0.02 * v]];
            let new = new.number("coulomb", level).number("static", level).number("velocity", log(1e-4 * v, 3.0 * site.speed_peak));
            Some(new.tidy(|values| values[1][0] = values[1][0].max(values[0][0])).starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
