//! Dry friction that is lower near rest.

use super::stribeck;
use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{ElementBuilder, Freedom, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

/// The least speed used along a motion, as a share of the 0.9 quantile of speed. Below it two other causes look like less friction at rest: friction that
/// changes its direction over a small displacement, and a motion that is known only to a step.
const SLOWEST: f64 = 0.1;

pub(super) const PHYSICS: Physics = Physics {
    name: "friction_deficit",
    family: Family::Friction,
    words: "dry friction that is lower near rest",
    size: "coulomb",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::NearRest,
    facts: Facts {
        sliding: &["coulomb"],
        from_level: &["coulomb"],
        contains: &["coulomb"],
        spans: |h, seen| {
            let Some(level) = h.starts.first().and_then(|start| start.first()).copied() else { return Vec::new() };
            // The level at speed, and that which is only there at speed.
            let one = |share: f64| {
                let velocity = seen.speed(share).max(SLOWEST * seen.speed(0.9));
                let sum = |factors: &[f64], values: &[Vec<f64>]| {
                    let (level, velocity) = values.first().map_or((0.0, 1.0), |v| (v[0], v[2]));
                    let of = |i: usize| factors.get(i).copied().unwrap_or(0.0) * level;
                    vec![of(0) + of(1), of(0), velocity]
                };
                ForceSpan { values: vec![vec![level, level * (1.0 - 1e-9), velocity], vec![level, 0.0, velocity]], sum }
            };
            stribeck::QUANTILES.map(one).to_vec()
        },
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, v) = (site.force, site.speed);
            let (new, stated) = new.in_place_of_friction(site)?;
            let (c, neutral) = stated.map_or((0.1 * f, Some(0.0)), |there| (there.level, there.neutral()));
            let most = 20.0 * f.max(c);
            let level = |least: f64| Freedom { range: (least, most), neutral: neutral.map(|n| n.max(least)), log: false };
            let starts = vec![vec![1.2 * c, 0.6 * c, 0.1 * v], vec![1.4 * c, 0.5 * c, 0.5 * v], vec![c, 0.5 * c, 0.02 * v]];
            let new = new.number("coulomb", level(1e-9 * most)).number("rest", level(0.0));
            // Strictly below the level at speed.
            let tidy = |values: &mut [Vec<f64>]| values[1][0] = values[1][0].min(values[0][0] * (1.0 - 1e-9));
            Some(new.number("velocity", log(1e-4 * v, 3.0 * site.speed_peak)).tidy(tidy).starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
