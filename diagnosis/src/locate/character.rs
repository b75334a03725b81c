//! The class of a force: odd or even, with memory or without, dependent on rate or not, and what energy it takes.

use super::law::{Form, Law, Variable};
use super::regression::Samples;
use crate::tuning::tuning;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What kind of force it is, whatever its name.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Character {
    /// Share of the force's mean over velocity and displacement that turns its sign with the motion; 1 is odd, 0 even.
    pub odd_share: f64,
    /// Whether it depends on the path: it follows displacement since reversal, or displacement by direction, better than displacement or velocity alone.
    pub memory: bool,
    /// Whether it depends on how fast, not only on which way.
    pub rate_dependent: bool,
    /// Energy that it takes from the device in a cycle, J: the median over cycles.
    pub dissipated_per_cycle: f64,
    /// Exponent of that energy over the amplitude of the cycle: 1 is dry friction, 2 viscous or hysteretic; none (in files null) where amplitudes hardly differ.
    pub energy_exponent: Option<f64>,
    /// Cycles that it was taken from.
    pub cycles: usize,
}

impl Character {
    /// `None` where nothing moves across the place.
    pub(super) fn of(samples: &Samples, laws: &[Law], period: f64) -> Option<Character> {
        if samples.x.is_empty() {
            return None;
        }
        let share =
            |variable: Variable| laws.iter().filter(|l| l.variable == variable).map(|l| l.held_out_share).fold(f64::NEG_INFINITY, f64::max);
        let without_memory = [Variable::Direction, Variable::Velocity, Variable::Displacement, Variable::Ripple].map(share);
        let without_memory = without_memory.into_iter().fold(0.0, f64::max);
        let with_memory = share(Variable::SinceReversal).max(share(Variable::DisplacementByDirection));
        let by_direction = share(Variable::Direction).max(share(Variable::SinceReversal)).max(share(Variable::DisplacementByDirection));
        let (cycles, amplitudes): (Vec<f64>, Vec<f64>) = cycles(samples, period).into_iter().unzip();
        let mut sorted = cycles.clone();
        sorted.sort_by(f64::total_cmp);
        Some(Character {
            odd_share: odd_share(laws),
            memory: with_memory > without_memory + tuning().locate.clearly,
            rate_dependent: share(Variable::Velocity) > by_direction + tuning().locate.clearly,
            dissipated_per_cycle: sorted.get(sorted.len() / 2).copied().unwrap_or(0.0),
            energy_exponent: exponent(&cycles, &amplitudes),
            cycles: cycles.len(),
        })
    }
}

/// Energy and amplitude of each cycle: between every second turning point of one run.
fn cycles(samples: &Samples, period: f64) -> Vec<(f64, f64)> {
    let turns = &samples.reversals.at;
    let of = |i: usize| {
        let (from, to) = (turns[i], turns[i + 2]);
        if samples.run[from] != samples.run[to] {
            return None;
        }
        let work: f64 = (from..to).map(|k| samples.force[k] * samples.v[k] * period).sum();
        let (low, high) = samples.x[from..to].iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        Some((work, 0.5 * (high - low)))
    };
    (0..turns.len().saturating_sub(2)).step_by(2).filter_map(of).collect()
}

/// Slope of log energy over log amplitude, cycles of large energy counting more.
fn exponent(energies: &[f64], amplitudes: &[f64]) -> Option<f64> {
    let points: Vec<(f64, f64, f64)> =
        energies.iter().zip(amplitudes).filter(|(e, a)| **e > 0.0 && **a > 0.0).map(|(e, a)| (a.ln(), e.ln(), *e)).collect();
    if points.len() < 6 {
        return None;
    }
    let all: f64 = points.iter().map(|p| p.2).sum();
    let mean = |of: fn(&(f64, f64, f64)) -> f64| points.iter().map(|p| of(p) * p.2).sum::<f64>() / all;
    let (ma, me) = (mean(|p| p.0), mean(|p| p.1));
    let var = points.iter().map(|p| (p.0 - ma).powi(2) * p.2).sum::<f64>() / all;
    let cov = points.iter().map(|p| (p.0 - ma) * (p.1 - me) * p.2).sum::<f64>() / all;
    (var.sqrt() > 0.5 * tuning().locate.range.ln()).then(|| cov / var)
}

/// Of the curve that explains most among those over velocity and displacement: how much of it turns its sign with its variable.
fn odd_share(laws: &[Law]) -> f64 {
    let best = laws
        .iter()
        .filter(|l| matches!(l.variable, Variable::Velocity | Variable::Displacement) && l.form == Form::Binned)
        .max_by(|a, b| a.held_out_share.total_cmp(&b.held_out_share));
    let Some(law) = best else { return 0.0 };
    // The curve at -z, by the nearest point of it.
    let at = |z: f64| {
        let next = law.curve.partition_point(|p| p.at < z);
        let near = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|i| law.curve.get(i));
        near.min_by(|a, b| (a.at - z).abs().total_cmp(&(b.at - z).abs())).map_or(0.0, |p| p.mean)
    };
    let (mut odd, mut even) = (0.0, 0.0);
    for point in &law.curve {
        let (here, there) = (point.mean, at(-point.at));
        odd += point.count as f64 * (0.5 * (here - there)).powi(2);
        even += point.count as f64 * (0.5 * (here + there)).powi(2);
    }
    if odd + even > 0.0 { odd / (odd + even) } else { 0.0 }
}
