//! Dry friction of another level in each direction.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{ElementBuilder, even};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "asymmetric_coulomb",
    family: Family::Friction,
    words: "dry friction that differs by direction",
    size: "positive",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::Lopsided,
    facts: Facts {
        twin: Some("asymmetric dry friction and dry friction with a bias are the same force: a force sensor at rest separates them"),
        sliding: &["positive", "negative"],
        contains: &["coulomb"],
        spans: |h, _| match h.starts.first() {
            Some(start) if start.len() == 2 => vec![ForceSpan::linear(vec![vec![start[0], 0.0], vec![0.0, start[0]]])],
            _ => Vec::new(),
        },
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let f = site.force;
            let (new, c) = new.in_place_of_plain_friction(site)?;
            let room = even(0.0, 20.0 * f.max(c.unwrap_or(0.0)), c.unwrap_or(0.0));
            let c = c.unwrap_or(0.1 * f);
            let starts = vec![vec![1.3 * c, 0.7 * c], vec![0.7 * c, 1.3 * c], vec![0.2 * c, 0.1 * c]];
            Some(new.number("positive", room).number("negative", room).starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
