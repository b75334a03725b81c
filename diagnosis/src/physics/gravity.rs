//! Gravity on a body that turns: a mass off its axis. As an element it is a ripple that repeats once a turn.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{ElementBuilder, any, even};
use crate::hypothesis::sites::Reach;
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::Motion;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Travel, rad, below which a sine of the angle is a spring and a constant to within what friction leaves.
const LEAST_TRAVEL: f64 = 0.5;

pub(super) const PHYSICS: Physics = Physics {
    name: "gravity",
    family: Family::Gravity,
    words: "gravity (a mass off the axis)",
    size: "amplitude",
    against: Against::Displacement,
    state: State::WithItsVariable,
    mark: Mark::Ripple,
    facts: Facts {
        proportional: true,
        // That it repeats once a turn: where the travel is short, a spring is the simpler reading of the same force.
        fixed: 1,
        spans: |h, seen| match h.starts.first().and_then(|start| start.first()) {
            Some(amplitude) if seen.travel > LEAST_TRAVEL => {
                let sum = |factors: &[f64], values: &[Vec<f64>]| {
                    let amplitude = values.first().and_then(|v| v.first()).copied().unwrap_or(0.0);
                    let of = |i: usize| factors.get(i).copied().unwrap_or(0.0);
                    vec![amplitude * of(0).hypot(of(1)), of(1).atan2(of(0))]
                };
                vec![ForceSpan { values: vec![vec![*amplitude, 0.0], vec![*amplitude, FRAC_PI_2]], sum }]
            }
            _ => Vec::new(),
        },
        ..Facts::NONE
    },
    propose: |sites| {
        let turns = sites.model.motion == Motion::Rotation;
        let one = |site| {
            let new = ElementBuilder::of_kind(sites, &PHYSICS, "cogging", site)?;
            let f = site.force;
            let new = new.number("amplitude", even(-20.0 * f, 20.0 * f, 0.0)).fixed("period", TAU).number("phase", any(-10.0, 10.0));
            Some(new.starts([0.0, FRAC_PI_2].map(|phase| vec![0.05 * f, phase]).to_vec()))
        };
        let swings = sites.near().filter(|site| turns && site.reach == Reach::Ground && 2.0 * site.displacement_peak > LEAST_TRAVEL);
        swings.filter(|site| !sites.has(site, &["cogging"])).filter_map(one).collect()
    },
};
