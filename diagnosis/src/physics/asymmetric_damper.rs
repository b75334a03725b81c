//! Viscous friction of another slope in each direction: a valve that opens one way.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{ElementBuilder, even, first_value};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "asymmetric_damper",
    family: Family::Damping,
    words: "viscous friction that differs by direction",
    size: "positive",
    against: Against::Velocity,
    state: State::WithItsVariable,
    mark: Mark::Lopsided,
    facts: Facts {
        contains: &["damper"],
        spans: |h, _| match h.starts.first() {
            Some(start) if start.len() == 2 => vec![ForceSpan::linear(vec![vec![start[0], 0.0], vec![0.0, start[0]]])],
            _ => Vec::new(),
        },
        ..Facts::NONE
    },
    propose: |sites| {
        let places = sites.near().filter(|site| !sites.has(site, &["asymmetric_damper", "backlash"]));
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let typical = site.force / site.speed;
            let (new, stated) = match sites.first_of(site, &["damper"]) {
                None => (new, None),
                Some((index, e)) => (new.replacing(index), Some(first_value(&e.law))),
            };
            let neutral = stated.unwrap_or(0.0);
            let room = even(0.0, 1000.0 * typical.max(neutral), neutral);
            let b = if neutral > 0.0 { neutral } else { 0.1 * typical };
            Some(new.number("positive", room).number("negative", room).starts(vec![vec![1.3 * b, 0.7 * b], vec![0.7 * b, 1.3 * b]]))
        };
        places.filter_map(one).collect()
    },
};
