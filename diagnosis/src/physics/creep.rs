//! A spring that goes on yielding under a constant force.

use crate::hypothesis::builder::{ElementBuilder, Freedom, first_value, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "creep",
    family: Family::Stiffness,
    words: "a spring that creeps",
    size: "creep_stiffness",
    against: Against::Displacement,
    state: State::WithItsVariable,
    mark: Mark::Other,
    facts: Facts {
        memory: true,
        holds: true,
        // Where nothing yields later it is a spring.
        contains: &["spring"],
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let (index, spring) = sites.holding(site).filter(|(_, e)| e.law.kind().name == "spring")?;
            let k = first_value(&spring.law);
            let (period, duration) = (sites.scales.period, sites.scales.duration);
            let new = ElementBuilder::new(sites, &PHYSICS, site).filter(|_| k > 0.0)?.replacing(index);
            let stiffness = Freedom { neutral: Some(k), ..log(1e-2 * k, 1e3 * k) };
            let retarded = Freedom { neutral: Some(1e4 * k), ..log(1e-2 * k, 1e4 * k) };
            let new =
                new.number("stiffness", stiffness).list("creep_stiffness", 1, retarded).list("time", 1, log(2.0 * period, 10.0 * duration));
            let starts = [(1.1, 5.0, 0.1), (1.3, 3.0, 0.01), (1.1, 5.0, 1.0), (1.5, 2.0, 0.001)];
            Some(
                new.starts(starts.map(|(at_once, later, time)| vec![at_once * k, later * k, (time * duration).max(3.0 * period)]).to_vec()),
            )
        };
        sites.near().filter_map(one).collect()
    },
};
