//! A spring whose force follows one line when it is stretched and another when it is released.

use crate::hypothesis::builder::{ElementBuilder, even, log};
use crate::hypothesis::{Against, Facts, Family, Hypothesis, Mark, Parameter, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "hysteretic_spring",
    family: Family::Hysteresis,
    words: "a hysteretic spring",
    size: "stiffness_positive",
    against: Against::Displacement,
    state: State::WithItsVariable,
    mark: Mark::Memory,
    facts: Facts {
        memory: true,
        holds: true,
        // Without slopes, and the same both ways, it is the Dahl friction.
        contains: &["spring", "dahl"],
        refine: |coarse, values, finer| (coarse.physics.name == super::dahl::PHYSICS.name).then(|| about(values, finer)).flatten(),
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, x) = (site.force, site.displacement);
            let (new, stated) = new.in_place_of_spring(site)?;
            let neutral = stated.unwrap_or(0.0).max(0.0);
            let most = (f / x).max(neutral);
            let slope = even(0.0, 1000.0 * most, neutral);
            let offset = even(-100.0 * most * x, 100.0 * most * x, 0.0);
            let new = new
                .number("stiffness_positive", slope)
                .number("stiffness_negative", slope)
                .number("offset_positive", offset)
                .number("offset_negative", offset)
                .number("bandwidth", log(0.1 / x, 1e4 / x));
            let k = if neutral > 0.0 { neutral } else { 0.05 * f / x };
            let half = 0.1 * k * x;
            let start = |bandwidth: f64| vec![k, k, half, -half, bandwidth / x];
            Some(new.starts(vec![start(10.0), start(100.0), start(2.0)]))
        };
        sites.near().filter_map(one).collect()
    },
};

/// The same loop as Dahl friction beside the spring that stands there: each line at the level of friction, reached at the rate of its stiffness.
fn about(dahl: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    let &[stiffness, level] = dahl else { return None };
    let first = finer.starts.first()?;
    let value = |(p, start): (&Parameter, &f64)| {
        let value = match p.key.as_str() {
            "offset_positive" => level,
            "offset_negative" => -level,
            "bandwidth" => stiffness / level,
            _ => p.neutral.unwrap_or(*start),
        };
        value.clamp(p.range.0, p.range.1)
    };
    Some(finer.parameters.iter().zip(first).map(value).collect())
}
