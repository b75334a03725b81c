//! A joint with play: it stands in the place of the joint's spring and damper.

use super::Physics;
use super::builder::{ElementBuilder, even, first_value};

pub(super) const PHYSICS: Physics = Physics {
    name: "backlash",
    family: "contact",
    // With no gap it is a spring and a damper.
    contains: &["spring"],
    propose: |sites| {
        let one = |site| {
            // Play without a shaft is nothing.
            let (index, spring) = sites.first_of(site, &["spring"])?;
            let damper = sites.first_of(site, &["damper"]);
            let new = ElementBuilder::new(sites, &PHYSICS, site)?.replacing(index).removing(damper.map(|(i, _)| i));
            let (k, b) = (first_value(&spring.law).max(0.0), damper.map_or(0.0, |(_, d)| first_value(&d.law).max(0.0)));
            let (x, typical) = (site.displacement, site.force / site.displacement);
            let new = new
                .number("gap", even(0.0, 4.0 * site.displacement_peak, 0.0))
                .number("stiffness", even(0.0, 1000.0 * k.max(typical), k))
                .number("damping", even(0.0, 1000.0 * b.max(site.force / site.speed), b));
            // The spring as refitted has the joint's deflection at the forces that act: of that a gap takes a share, and the shaft is as much stiffer.
            let shared = |share: f64| vec![2.0 * share * site.displacement_peak, k / (1.0 - share), b];
            Some(new.starts(vec![vec![0.2 * x, k, b], shared(0.5), vec![0.02 * x, k, b], shared(0.8), vec![x, k, b]]))
        };
        sites.near().filter_map(one).collect()
    },
};
