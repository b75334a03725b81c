//! A stop or a wall: it pushes on one side only.

use crate::hypothesis::builder::{ElementBuilder, any, even, first_value};
use crate::hypothesis::sites::{Site, Sites};
use crate::hypothesis::{Against, Facts, Family, Hypothesis, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "contact",
    family: Family::Contact,
    words: "a contact",
    size: "stiffness",
    against: Against::Displacement,
    state: State::Contact,
    mark: Mark::Gap,
    facts: Facts { holds: true, ..Facts::NONE },
    propose: |sites| sites.near().flat_map(|site| stops(sites, site).into_iter().chain(lifting(sites, site))).collect(),
};

/// Stops beside what is there, one for each side.
fn stops(sites: &Sites, site: &Site) -> Vec<Hypothesis> {
    let (peak, typical) = (site.displacement_peak, site.force / site.displacement);
    let one = |reversed: bool| {
        let new = ElementBuilder::new(sites, &PHYSICS, site)?;
        let new = if reversed { new.reversed() } else { new };
        let new = new
            .number("stiffness", even(0.0, 1000.0 * typical, 0.0))
            .number("damping", even(0.0, 100.0 * site.force / site.speed, 0.0))
            .number("gap", any(-peak, peak));
        let b = 0.01 * site.force / site.speed;
        Some(new.starts(vec![vec![typical, b, 0.7 * peak], vec![typical, b, 0.3 * peak], vec![0.3 * typical, b, 0.0]]))
    };
    [false, true].into_iter().filter_map(one).collect()
}

/// A joint that lifts off: the spring and damper push, but do not pull.
fn lifting(sites: &Sites, site: &Site) -> Option<Hypothesis> {
    let (index, spring) = sites.first_of(site, &["spring"])?;
    let damper = sites.first_of(site, &["damper"]);
    let (k, b) = (first_value(&spring.law).max(0.0), damper.map_or(0.0, |(_, d)| first_value(&d.law).max(0.0)));
    let (peak, typical) = (site.displacement_peak, site.force / site.displacement);
    let new = ElementBuilder::new(sites, &PHYSICS, site)?.replacing(index).removing(damper.map(|(i, _)| i)).tag("lifting");
    let new = new
        .number("stiffness", any(0.0, 1000.0 * k.max(typical)))
        .number("damping", any(0.0, 1000.0 * b.max(site.force / site.speed)))
        .number("gap", any(-2.0 * peak, peak));
    Some(new.starts(vec![vec![k, b, -peak], vec![k, b, -0.5 * peak], vec![k, b, 0.0]]))
}
