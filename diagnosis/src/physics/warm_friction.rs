//! Dry friction that its own heat lowers.

use crate::hypothesis::builder::{ElementBuilder, Freedom, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "warm_friction",
    family: Family::Friction,
    words: "dry friction that falls as it warms up",
    size: "force",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::Other,
    facts: Facts {
        sliding: &["force"],
        from_level: &["force"],
        memory: true,
        // Where no heat lowers it, it is dry friction of one level.
        contains: &["coulomb"],
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (new, stated) = new.in_place_of_plain_friction(site)?;
            let (f, duration) = (site.force, sites.scales.duration);
            let c = stated.unwrap_or(0.1 * f);
            let level = Freedom { range: (0.0, 20.0 * f.max(c)), neutral: Some(stated.unwrap_or(0.0)), log: false };
            // What a friction of that level makes of heat in a recording.
            let heat = c * site.speed * duration;
            let half_heat = Freedom { neutral: stated.map(|_| 1e3 * heat), ..log(1e-3 * heat, 1e3 * heat) };
            let new =
                new.number("force", level).number("half_heat", half_heat).number("cooling_time", log(1e-3 * duration, 100.0 * duration));
            let starts = [(1.3, 0.5, 0.3), (1.6, 0.3, 1.0), (1.3, 0.05, 0.05)];
            Some(new.starts(starts.map(|(level, share, time)| vec![level * c, share * heat, time * duration]).to_vec()))
        };
        sites.near().filter_map(one).collect()
    },
};
