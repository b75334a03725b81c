//! Bristle friction with non-local memory. Proposed as soon as the plant can simulate it.

use super::Physics;
use super::builder::{ElementBuilder, Freedom, any, log, replaced_friction};
use super::sites::FRICTION;

pub(super) const PHYSICS: Physics = Physics {
    name: "preisach_lugre",
    family: "friction",
    contains: &["lugre", "dahl", "stribeck", "coulomb"],
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            // The registry describes the kind before there is a law to build.
            let kind = backdrive_plant::elements::kind_named(PHYSICS.name)?;
            (kind.build)(&vec![vec![1.0]; kind.parameters.len()]).ok()?;
            let (f, x, v) = (site.force, site.displacement, site.speed);
            let (new, stated) = match sites.first_of(site, &FRICTION) {
                None => (new, (0.1 * f, Some(1e-6 * f))),
                Some((_, e)) if e.law.kind().name == "preisach_lugre" => return None,
                Some((index, e)) => (new.replacing(index), replaced_friction(&e.law)),
            };
            let (c, neutral) = stated;
            let level = Freedom { range: (1e-6 * f, 20.0 * f.max(c)), neutral: neutral.map(|n| n.max(1e-6 * f)), log: false };
            let new = new
                .number("stiffness", log(0.01 * f / x, 1e6 * f / x))
                .number("damping", any(0.0, 100.0 * f / v))
                .number("coulomb", level)
                .number("static", level)
                .number("velocity", log(1e-4 * v, 3.0 * site.speed_peak))
                .number("break_away", log(1e-5 * x, x))
                .number("loop_force", log(1e-6 * f, 20.0 * f.max(c)))
                .number("loop_slope", log(1e-3 * f / x, 1e6 * f / x))
                .tidy(|values| values[3][0] = values[3][0].max(values[2][0]));
            Some(new.starts(vec![vec![c / (0.05 * x), 0.05 * c / v, c, 1.5 * c, 0.1 * v, 0.05 * x, c, c / (0.05 * x)]]))
        };
        sites.near().filter_map(one).collect()
    },
};
