//! Smooth hysteresis: part of the stiffness yields.

use crate::hypothesis::builder::{ElementBuilder, any, even, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "bouc_wen",
    family: Family::Hysteresis,
    words: "hysteresis (Bouc-Wen)",
    size: "stiffness",
    against: Against::Displacement,
    state: State::WithItsVariable,
    mark: Mark::Memory,
    facts: Facts {
        memory: true,
        holds: true,
        // Without a yielding share it is a spring; with nothing else, γ = 0 and n = 1 it is the Dahl friction.
        contains: &["spring", "dahl"],
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (typical, x) = (site.force / site.displacement, site.displacement);
            let (new, stated) = new.in_place_of_spring(site)?;
            let neutral = stated.unwrap_or(0.0).max(0.0);
            let most = typical.max(neutral);
            let ratio = if stated.is_some() { even(0.0, 1.0, 1.0) } else { any(0.0, 1.0) };
            let new = new
                .number("stiffness", even(0.0, 1000.0 * most, neutral))
                .number("ratio", ratio)
                .fixed("amplitude", 1.0)
                .number("beta", log(1e-3 / x, 1e6 / (x * x).min(x)))
                .number("gamma", any(-1e6 / (x * x).min(x), 1e6 / (x * x).min(x)))
                .number("exponent", any(1.0, 4.0))
                .tidy(|values| values[4][0] = values[4][0].max(-0.95 * values[3][0]));
            let k = if neutral > 0.0 { neutral } else { 0.2 * typical };
            // z yields at (1/(β + γ))^(1/n).
            let start = |share: f64, yields: f64, n: f64| {
                let half = 0.5 / (yields * x).powf(n);
                vec![k / (share + 0.5 * (1.0 - share)), share, half, half, n]
            };
            Some(new.starts(vec![start(0.7, 0.3, 1.0), start(0.9, 0.05, 1.0), start(0.5, 0.5, 2.0), start(0.1, 0.3, 1.0)]))
        };
        sites.near().filter_map(one).collect()
    },
};
