//! Friction that builds up over a distance.

use super::Physics;
use super::builder::{ElementBuilder, friction_level, log};
use super::sites::FRICTION;

/// Forces over displacements of the recordings up to which friction builds up over a distance that could show: stiffer, it is dry friction, and a fit only
/// imitates the steps of whoever simulated or sampled it.
pub(super) const STIFFEST: f64 = 1e4;

pub(super) const PHYSICS: Physics = Physics {
    name: "dahl",
    family: "friction",
    // Infinitely stiff, it is dry friction.
    contains: &["coulomb"],
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, x) = (site.force, site.displacement);
            let (new, stated) = match sites.first_of(site, &FRICTION) {
                None => (new, None),
                Some((_, e)) if e.law.kind().name == "dahl" => return None,
                Some((index, e)) => (new.replacing(index), Some(friction_level(&e.law))),
            };
            let c = stated.unwrap_or(0.1 * f);
            let most = 20.0 * f.max(c);
            let mut coulomb = log(1e-6 * f, most);
            coulomb.neutral = stated.is_none().then_some(1e-6 * f);
            let new = new.number("stiffness", log(0.01 * f / x, STIFFEST * f / x)).number("coulomb", coulomb);
            let starts =
                vec![vec![c / (0.05 * x), c], vec![c / (0.5 * x), c], vec![c / (0.005 * x), c], vec![3.0 * c / (0.2 * x), 3.0 * c]];
            Some(new.starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
