//! A force that repeats with position: the poles of a motor, a screw's turn, gear teeth.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{ElementBuilder, any, even, log};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

/// Periods that fits start from, in a peak-to-peak travel, longest first; a ripple has to be seen to come again.
const PERIODS: [f64; 13] = [0.71, 0.5, 0.35, 0.25, 0.18, 0.125, 0.088, 0.0625, 0.044, 0.031, 0.022, 0.016, 0.011];

/// Grid of periods per travel: the first value, its step (an eighth of a period at the ends of the travel), and the number of values.
const FEWEST: f64 = 1.5;
const STEP: f64 = 0.125;
const RIPPLES: usize = 180;

pub(super) const PHYSICS: Physics = Physics {
    name: "cogging",
    family: Family::Ripple,
    words: "a ripple over position (cogging)",
    size: "amplitude",
    against: Against::Displacement,
    state: State::Periodic,
    mark: Mark::Ripple,
    facts: Facts {
        proportional: true,
        spans: |h, seen| {
            let Some(amplitude) = h.starts.first().and_then(|start| start.first()).copied() else { return Vec::new() };
            let one = |per_travel: f64| {
                let sum = |factors: &[f64], values: &[Vec<f64>]| {
                    let (amplitude, period) = values.first().map_or((0.0, 1.0), |v| (v[0], v[1]));
                    let of = |i: usize| factors.get(i).copied().unwrap_or(0.0);
                    vec![amplitude * of(0).hypot(of(1)), period, of(1).atan2(of(0))]
                };
                let at = |phase: f64| vec![amplitude, seen.travel / per_travel, phase];
                ForceSpan { values: vec![at(0.0), at(std::f64::consts::FRAC_PI_2)], sum }
            };
            (0..RIPPLES).map(|n| one(FEWEST + STEP * n as f64)).collect()
        },
        ..Facts::NONE
    },
    propose: |sites| {
        let one = |site| {
            let new = ElementBuilder::new(sites, &PHYSICS, site)?;
            let (travel, f) = (2.0 * site.displacement_peak, site.force);
            let new = new
                .number("amplitude", even(-20.0 * f, 20.0 * f, 0.0))
                // What does not come again within the travel is a spring, not a ripple.
                .number("period", log(1e-4 * travel, PERIODS[0] * sites.scales.reach * travel))
                // More than a turn, so that no fit runs into an end.
                .number("phase", any(-10.0, 10.0));
            // The force is linear in a cos(phase) and a sin(phase): two phases span it. What a period scan finds is a better start.
            let starts = PERIODS.iter().flat_map(|p| [0.0, std::f64::consts::FRAC_PI_2].map(|phase| vec![0.05 * f, p * travel, phase]));
            Some(new.starts(starts.collect()))
        };
        sites.near().filter_map(one).collect()
    },
};
