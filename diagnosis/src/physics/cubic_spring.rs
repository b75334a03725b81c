//! Stiffness that rises or falls with deflection.

use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "cubic_spring",
    family: Family::Stiffness,
    words: "a stiffening spring",
    size: "cubic",
    against: Against::Displacement,
    state: State::WithItsVariable,
    mark: Mark::Shape,
    facts: Facts { holds: true, contains: &["spring"], ..Facts::NONE },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (typical, x) = (site.force / site.displacement, site.displacement);
            let (new, stated) = new.in_place_of_spring(site)?;
            let neutral = stated.unwrap_or(0.0);
            let most = typical.max(neutral.abs());
            let cubic = 1000.0 * most / (x * x);
            // With less than none it would snap from one rest to another: that imitates a play, and is no spring.
            let new = new.number("stiffness", even(neutral.min(0.0), 1000.0 * most, neutral)).number("cubic", even(-cubic, cubic, 0.0));
            // A quarter of the force at full deflection; less where it softens, which at twice that lets go.
            let k = if neutral > 0.0 { neutral } else { 0.2 * typical };
            let softer = -0.1 * k / (site.displacement_peak * site.displacement_peak);
            Some(new.starts(vec![vec![neutral, 0.25 * k / (x * x)], vec![neutral, softer]]))
        };
        sites.near().filter_map(one).collect()
    },
};
