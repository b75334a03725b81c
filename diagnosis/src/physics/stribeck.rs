//! Dry friction that falls with speed.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{ElementBuilder, Freedom, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

/// Shares of the time during which a motion is slower than the speed at which what is beyond at rest has fallen, as they are looked at along it.
pub(super) const QUANTILES: [f64; 6] = [0.1, 0.2, 0.32, 0.45, 0.6, 0.75];
/// The least such speed, in that of nine tenths of the time: slower, a low-passed motion does not resolve it.
pub(super) const SLOWEST: f64 = 0.03;

pub(super) const PHYSICS: Physics = Physics {
    name: "stribeck",
    family: Family::Friction,
    words: "dry friction with stiction (Stribeck)",
    size: "static",
    against: Against::Velocity,
    state: State::Reversals,
    mark: Mark::NearRest,
    facts: Facts {
        sliding: &["coulomb"],
        from_level: &["coulomb", "static"],
        contains: &["coulomb"],
        spans: |h, seen| {
            let Some(level) = h.starts.first().and_then(|start| start.first()).copied() else { return Vec::new() };
            // The level at speed, and what is beyond it at rest.
            let one = |share: f64| {
                let velocity = seen.speed(share).max(SLOWEST * seen.speed(0.9));
                let sum = |factors: &[f64], values: &[Vec<f64>]| {
                    let (level, velocity) = values.first().map_or((0.0, 1.0), |v| (v[0], v[2]));
                    let of = |i: usize| factors.get(i).copied().unwrap_or(0.0) * level;
                    vec![of(0), of(0) + of(1), velocity]
                };
                ForceSpan { values: vec![vec![level, level, velocity], vec![0.0, level, velocity]], sum }
            };
            QUANTILES.map(one).to_vec()
        },
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, v) = (site.force, site.speed);
            let (new, stated) = new.in_place_of_friction(site)?;
            let (c, neutral) = stated.map_or((0.1 * f, Some(0.0)), |there| (there.level, there.neutral()));
            let level = Freedom { range: (0.0, 20.0 * f.max(c)), neutral, log: false };
            let starts = vec![vec![c, 1.6 * c, 0.1 * v], vec![0.8 * c, 1.5 * c, 0.5 * v], vec![c, 1.6 * c, 0.02 * v]];
            let new = new.number("coulomb", level).number("static", level).number("velocity", log(1e-4 * v, 3.0 * site.speed_peak));
            Some(new.tidy(|values| values[1][0] = values[1][0].max(values[0][0])).starts(starts))
        };
        sites.near().filter_map(one).collect()
    },
};
