//! Friction that builds up over a distance.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{ElementBuilder, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

/// Largest stiffness, in units of the recordings' force divided by their displacement, at which a build-up of friction over a distance could show. Stiffer,
/// it is dry friction, and a fit only imitates the steps of the simulation or of the sampling.
pub(super) const STIFFEST: f64 = 1e4;

/// Displacements over which the friction builds up that are looked at along a motion, in its travel.
const SLIPS: [f64; 8] = [0.0015, 0.0025, 0.004, 0.0065, 0.01, 0.016, 0.026, 0.06];

pub(super) const PHYSICS: Physics = Physics {
    name: "dahl",
    family: Family::Friction,
    words: "dry friction with presliding (Dahl)",
    size: "coulomb",
    against: Against::Displacement,
    state: State::Reversals,
    mark: Mark::Presliding,
    facts: Facts {
        sliding: &["coulomb"],
        from_level: &["coulomb"],
        memory: true,
        // Infinitely stiff, it is dry friction.
        contains: &["coulomb"],
        spans: |h, seen| {
            let Some(level) = h.starts.first().and_then(|start| start.get(1)).copied() else { return Vec::new() };
            let one = |share: f64| {
                let sum = |factors: &[f64], values: &[Vec<f64>]| {
                    let factor = factors.first().copied().unwrap_or(1.0);
                    values.first().map(|v| v.iter().map(|x| factor * x).collect()).unwrap_or_default()
                };
                ForceSpan { values: vec![vec![level / (share * seen.travel), level]], sum }
            };
            SLIPS.map(one).to_vec()
        },
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (f, x) = (site.force, site.displacement);
            let (new, stated) = new.in_place_of_friction(site)?;
            let c = stated.map_or(0.1 * f, |there| there.level);
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
