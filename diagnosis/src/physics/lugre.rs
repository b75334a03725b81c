//! Bristle friction: presliding, a level that falls with speed, and lag between them.

use crate::hypothesis::builder::{ElementBuilder, Freedom, any, log};
use crate::hypothesis::{Against, Facts, Family, Hypothesis, Mark, Parameter, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "lugre",
    family: Family::Friction,
    words: "dry friction with presliding (LuGre)",
    size: "coulomb",
    against: Against::Displacement,
    state: State::Reversals,
    mark: Mark::Presliding,
    facts: Facts {
        sliding: &["coulomb"],
        from_level: &["coulomb", "static"],
        memory: true,
        refine: |coarse, values, finer| (coarse.physics.name == super::dahl::PHYSICS.name).then(|| around(values, finer)).flatten(),
        contains: &["dahl", "stribeck", "coulomb"],
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, x, v) = (site.force, site.displacement, site.speed);
            let (new, stated) = new.in_place_of_friction(site)?;
            let (c, neutral) = stated.map_or((0.1 * f, Some(1e-6 * f)), |there| (there.level, there.neutral()));
            let level = Freedom { range: (1e-6 * f, 20.0 * f.max(c)), neutral: neutral.map(|n| n.max(1e-6 * f)), log: false };
            let new = new
                .number("stiffness", log(0.01 * f / x, super::dahl::STIFFEST * f / x))
                .number("damping", any(0.0, 100.0 * f / v))
                .number("coulomb", level)
                .number("static", level)
                .number("velocity", log(1e-4 * v, 3.0 * site.speed_peak))
                .tidy(|values| values[3][0] = values[3][0].max(values[2][0]));
            let start = |x_slip: f64, v_slip: f64| vec![c / (x_slip * x), 0.05 * c / v, c, 1.5 * c, v_slip * v];
            Some(new.starts(vec![start(0.05, 0.1), start(0.005, 0.1), start(0.05, 0.5), start(0.005, 0.02), start(0.5, 0.3)]))
        };
        sites.near().filter_map(one).collect()
    },
};

/// What holds a body at rest over what it slides with, at first.
const HOLDS: f64 = 1.2;

/// Values about those of Dahl's law, whose level is that at speed, and a little more at rest.
fn around(dahl: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    let &[stiffness, level] = dahl else { return None };
    let first = finer.starts.first()?;
    let value = |(p, start): (&Parameter, &f64)| {
        let value = match p.key.as_str() {
            "stiffness" => stiffness,
            "coulomb" => level,
            "static" => HOLDS * level,
            _ => *start,
        };
        value.clamp(p.range.0, p.range.1)
    };
    Some(finer.parameters.iter().zip(first).map(value).collect())
}
