//! A stop that hardens and whose damping grows with how deep it is pressed.

use crate::hypothesis::builder::{ElementBuilder, any, even};
use crate::hypothesis::sites::Site;
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "hunt_crossley",
    family: Family::Contact,
    words: "a contact (Hunt-Crossley)",
    size: "stiffness",
    against: Against::Displacement,
    state: State::Contact,
    mark: Mark::Gap,
    facts: Facts { holds: true, contains: &["contact"], ..Facts::NONE },
    propose: |sites| {
        let one = |(site, reversed): (&Site, bool)| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let new = if reversed { new.reversed() } else { new };
            let (peak, f) = (site.displacement_peak, site.force);
            // Parameters of an exponent of 1.5; the range covers the others.
            let k = f / site.displacement.powf(1.5);
            let lambda = k / site.speed_peak;
            let most = 1e4 * f / site.displacement.min(1.0).powf(3.0);
            let new = new
                .number("stiffness", even(0.0, most, 0.0))
                .number("damping", even(0.0, most / site.speed_peak, 0.0))
                .number("exponent", any(1.0, 3.0))
                .number("gap", any(-peak, peak));
            let start = |gap: f64| vec![k, 0.1 * lambda, 1.5, gap * peak];
            Some(new.starts(vec![start(0.7), start(0.3), start(0.0)]))
        };
        sites.near().flat_map(|site| [(site, false), (site, true)]).filter_map(one).collect()
    },
};
