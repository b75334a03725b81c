//! The fit of admittances: the cost (3), and its two steps over the oils.
//!
//! The model's admittance is that of its nonlinear simulation by the correlation method, moved by a sine of the amplitude that the ram had.

use super::bench::{Curve, Point, SETTLE_S};
use super::device::{Compensator, Parameter};
use backdrive_plant::correlation::{Resolution, admittance_of};
use nalgebra::{Complex, DMatrix, DVector};
use rayon::prelude::*;

/// Whether the modulus in (3) is used directly or squared (A).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// Sum of moduli.
    Modulus,
    /// Sum of their squares.
    Squared,
}

/// Steps of the simulated cycles: enough that halving them moves no admittance by more than 1 % (`tests/steering.rs`).
pub const RESOLUTION: Resolution = Resolution { steps_per_cycle: 400, rate_hz: 500.0, settle_s: SETTLE_S, cycles: 1 };

/// Modulus below which a residual counts as if squared, so that the sum of moduli has a slope everywhere.
const ROUNDING: f64 = 2e-3;
/// Change of a number's logarithm for a derivative.
const STEP: f64 = 0.01;
/// Farthest that a number may go from its start, in its logarithm.
const REACH: f64 = 2.0;

/// A finished fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The device.
    pub device: Compensator,
    /// Cost at its parameters.
    pub cost: f64,
    /// Root of the mean squared modulus of `(Y - E)/E`.
    pub rms: f64,
    /// Steps taken.
    pub steps: usize,
}

/// The model's admittance where the point was measured, N s/m; not a number where it cannot be simulated.
pub fn predicted(device: &Compensator, oil: usize, point: &Point) -> Complex<f64> {
    let nothing = Complex::new(f64::NAN, f64::NAN);
    admittance_of(&device.model(oil), [0, 0], point.frequency_hz, point.amplitude, &RESOLUTION).unwrap_or(nothing)
}

/// `(Y - E)/E` of every point of every curve.
pub fn residuals(device: &Compensator, curves: &[Curve]) -> Vec<Complex<f64>> {
    let points: Vec<(usize, &Point)> = curves.iter().flat_map(|c| c.points.iter().map(|p| (c.oil, p))).collect();
    points.par_iter().map(|(oil, p)| predicted(device, *oil, p) / p.admittance - 1.0).collect()
}

/// The cost of residuals.
pub fn cost(residuals: &[Complex<f64>], cost: Cost) -> f64 {
    let of = |r: &Complex<f64>| match cost {
        Cost::Modulus => (r.norm_sqr() + ROUNDING * ROUNDING).sqrt() - ROUNDING,
        Cost::Squared => r.norm_sqr(),
    };
    residuals.iter().map(of).sum()
}

/// Root of the mean squared modulus.
pub fn rms(residuals: &[Complex<f64>]) -> f64 {
    (cost(residuals, Cost::Squared) / residuals.len().max(1) as f64).sqrt()
}

/// Moves the free numbers until a step gains nothing (Levenberg and Marquardt on their logarithms; the sum of moduli by reweighting). All free
/// numbers must be above 0 at the start.
pub fn fit(start: &Compensator, curves: &[Curve], free: &[Parameter], by: Cost, most_steps: usize) -> Fit {
    let (mut device, mut found) = (*start, residuals(start, curves));
    let mut best = cost(&found, by);
    let (mut lambda, mut steps) = (1e-3_f64, 0);
    'steps: while steps < most_steps {
        let jacobian = jacobian(&device, curves, free, &found);
        let (normal, right) = normal_equations(&jacobian, &found, by);
        steps += 1;
        loop {
            let damped = DMatrix::from_fn(free.len(), free.len(), |i, j| normal[(i, j)] * if i == j { 1.0 + lambda } else { 1.0 });
            let Some(change) = damped.lu().solve(&right).filter(|c| c.iter().all(|c| c.is_finite())) else { break 'steps };
            let moved = free.iter().zip(change.iter()).fold(device, |device, (p, change)| {
                let limit = |log: f64| log.clamp(start.get(*p).ln() - REACH, start.get(*p).ln() + REACH);
                device.with(*p, limit(device.get(*p).ln() - change.clamp(-0.5, 0.5)).exp())
            });
            let next = residuals(&moved, curves);
            let value = cost(&next, by);
            if value < best {
                let gained = best - value;
                (device, found, best) = (moved, next, value);
                lambda = (0.2 * lambda).max(1e-9);
                if gained < 1e-4 * best {
                    break 'steps;
                }
                break;
            }
            lambda *= 8.0;
            if lambda > 1e4 {
                break 'steps;
            }
        }
    }
    Fit { device, cost: best, rms: rms(&found), steps }
}

/// Derivatives of all residuals to the logarithms of the free numbers. The same number of every oil is moved at once, for no curve knows two oils.
fn jacobian(device: &Compensator, curves: &[Curve], free: &[Parameter], at: &[Complex<f64>]) -> Vec<Vec<Complex<f64>>> {
    let oils: Vec<usize> = curves.iter().flat_map(|c| c.points.iter().map(|_| c.oil)).collect();
    let moved = |list: &[Parameter]| {
        let next = list.iter().fold(*device, |d, p| d.with(*p, d.get(*p) * STEP.exp()));
        residuals(&next, curves).iter().zip(at).map(|(n, a)| (n - a) / STEP).collect::<Vec<_>>()
    };
    let all = |of: fn(usize) -> Parameter| (0..4).map(of).filter(|p| free.contains(p)).collect::<Vec<_>>();
    let groups = [all(Parameter::Oil), all(Parameter::Beside)].map(|group| if group.is_empty() { Vec::new() } else { moved(&group) });
    let zero = Complex::new(0.0, 0.0);
    let own = |column: &[Complex<f64>], oil: usize| column.iter().zip(&oils).map(|(d, o)| if *o == oil { *d } else { zero }).collect();
    free.iter()
        .map(|p| match p {
            Parameter::Oil(oil) => own(&groups[0], *oil),
            Parameter::Beside(oil) => own(&groups[1], *oil),
            shared => moved(&[*shared]),
        })
        .collect()
}

fn normal_equations(jacobian: &[Vec<Complex<f64>>], at: &[Complex<f64>], by: Cost) -> (DMatrix<f64>, DVector<f64>) {
    let weight = |r: &Complex<f64>| match by {
        Cost::Modulus => 1.0 / (r.norm_sqr() + ROUNDING * ROUNDING).sqrt(),
        Cost::Squared => 1.0,
    };
    let weights: Vec<f64> = at.iter().map(weight).collect();
    let dot = |a: &[Complex<f64>], b: &[Complex<f64>]| {
        a.iter().zip(b).zip(&weights).map(|((a, b), w)| w * (a.re * b.re + a.im * b.im)).sum::<f64>()
    };
    let n = jacobian.len();
    (DMatrix::from_fn(n, n, |i, j| dot(&jacobian[i], &jacobian[j])), DVector::from_fn(n, |i, _| dot(&jacobian[i], at)))
}

/// c, and where the device has one c1, of every oil that was measured.
pub fn of_oils(start: &Compensator, curves: &[Curve]) -> Vec<Parameter> {
    let all = (0..4).flat_map(|oil| [Parameter::Oil(oil), Parameter::Beside(oil)]);
    all.filter(|p| curves.iter().any(|c| Some(c.oil) == p.oil()) && start.get(*p) > 0.0).collect()
}

/// The paper's two steps, once: first what the oils share, with the dampings as they are, then the dampings of each oil.
pub fn two_steps(start: &Compensator, curves: &[Curve], shared: &[Parameter], by: Cost, most_steps: usize) -> Fit {
    let first = fit(start, curves, shared, by, most_steps);
    fit(&first.device, curves, &of_oils(start, curves), by, most_steps)
}

/// The two steps, and then all numbers together until nothing is gained: where the two steps would end if they were repeated.
pub fn identify(start: &Compensator, curves: &[Curve], shared: &[Parameter], by: Cost, most_steps: usize) -> Fit {
    let begun = two_steps(start, curves, shared, by, 2);
    fit(&begun.device, curves, &[shared, &of_oils(start, curves)].concat(), by, most_steps)
}

/// The points up to a frequency, Hz.
pub fn up_to(curves: &[Curve], highest_hz: f64) -> Vec<Curve> {
    let cut = |c: &Curve| c.points.iter().filter(|p| p.frequency_hz <= highest_hz).copied().collect();
    curves.iter().map(|c| Curve { oil: c.oil, points: cut(c) }).collect()
}
