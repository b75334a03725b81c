//! Dry friction that is lower near rest.

use crate::hypothesis::builder::{ElementBuilder, Freedom, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "friction_deficit",
    family: Family::Friction,
    words: "dry friction that is lower near rest",
    size: "coulomb",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::NearRest,
    facts: Facts { sliding: &["coulomb"], from_level: &["coulomb"], contains: &["coulomb"], ..Facts::NONE },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, v) = (site.force, site.speed);
            let (new, stated) = new.in_place_of_friction(site)?;
            let (c, neutral) = stated.map_or((0.1 * f, Some(0.0)), |there| (there.level, there.neutral()));
            let most = 20.0 * f.max(c);
            let level = |least: f64| Freedom { range: (least, most), neutral: neutral.map(|n| n.max(least)), log: false };
            let starts = vec![vec![1.2 * c, 0.6 * c, 0.1 * v], vec![1.4 * c, 0.5 * c, 0.5 * v], vec![c, 0.5 * c, 0.02 * v]];
            let new = new.number("coulomb", level(1e-9 * most)).number("rest", level(0.0));
            // Strictly below the level at speed.
            let tidy = |values: &mut [Vec<f64>]| values[1][0] = values[1][0].min(values[0][0] * (1.0 - 1e-9));
            Some(new.number("velocity", log(1e-4 * v, 3.0 * site.speed_peak)).tidy(tidy).starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
