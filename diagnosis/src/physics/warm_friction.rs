//! Dry friction that its own heat lowers.

use crate::hypothesis::builder::{ElementBuilder, Freedom, log};
use crate::hypothesis::{Against, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "warm_friction",
    family: Family::Friction,
    words: "dry friction that falls as it warms up",
    size: "force",
    proportional: false,
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::Other,
    twin: None,
    sliding: &["force"],
    from_level: &["force"],
    memory: true,
    holds: false,
    refine: |_, _, _| None,
    // Where no heat lowers it, it is dry friction of one level.
    contains: &["coulomb"],
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (new, stated) = match sites.dry_friction(site) {
                None => (new, None),
                Some(there) if there.is_plain() => (new.replacing(there.index), Some(there.level)),
                Some(_) => return None,
            };
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
