//! Does a force repeat with position? A spectrum over displacement.

use crate::tuning::tuning;
use realfft::RealFftPlanner;
use serde::Serialize;

/// The strongest ripple of a force over displacement: `amplitude sin(2π x/period + phase)`, as the kind `cogging` has it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ripple {
    /// m or rad.
    pub period: f64,
    /// N or N m.
    pub amplitude: f64,
    /// rad.
    pub phase: f64,
    /// Share of the force's mean square, its slow course over displacement taken off, that it explains.
    pub share: f64,
    /// Its power over the median of all periods.
    pub prominence: f64,
}

/// Positions that the travel is cut into.
const CELLS: usize = 4096;
/// Cells of the transform: padded, so that peaks between two lines are not missed.
const PADDED: usize = 4 * CELLS;

/// Lines of the transform about a peak that are the peak's own.
const OWN_LINES: usize = 6;

/// The strongest ripples of `force` over `x`, strongest first; none where nothing moves. What the force owes to the direction and size of
/// the velocity `v` goes first.
pub fn scan(x: &[f64], v: &[f64], force: &[f64]) -> Vec<Ripple> {
    strongest(x, v, force).unwrap_or_default()
}

fn strongest(x: &[f64], v: &[f64], force: &[f64]) -> Option<Vec<Ripple>> {
    let n = x.len().min(force.len()).min(v.len());
    let (x, v, force) = (&x[..n], &v[..n], &force[..n]);
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let travel = high - low;
    if n < 16 || !(travel.is_finite() && travel > 0.0) {
        return None;
    }
    // The slow course over displacement goes first: a polynomial through the forces; and friction with it.
    let speed = v.iter().map(|v| v.abs()).fold(f64::MIN_POSITIVE, f64::max);
    let sign = |v: f64| if v == 0.0 { 0.0 } else { v.signum() };
    let basis = |x: f64, v: f64| {
        let u = 2.0 * (x - low) / travel - 1.0;
        [1.0, u, u * u, u * u * u, sign(v), v / speed]
    };
    let rows = || x.iter().zip(v).map(|(x, v)| basis(*x, *v));
    let slow = least_squares(rows().zip(force.iter().copied()))?;
    let rest: Vec<f64> = rows().zip(force).map(|(row, f)| f - row.iter().zip(&slow).map(|(b, c)| b * c).sum::<f64>()).collect();
    let power = rest.iter().map(|r| r * r).sum::<f64>();
    if power <= 0.0 {
        return None;
    }
    let mut sums = vec![0.0; PADDED];
    for (x, r) in x.iter().zip(&rest) {
        sums[(((x - low) / travel * CELLS as f64) as usize).min(CELLS - 1)] += r;
    }
    let mut planner = RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(PADDED);
    let mut spectrum = transform.make_output_vec();
    transform.process(&mut sums, &mut spectrum).ok()?;
    let turns = |line: usize| line as f64 * CELLS as f64 / PADDED as f64;
    // Periods shorter than the step from sample to sample cannot be resolved.
    let mut steps: Vec<f64> = x.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let middle = steps.len() / 2;
    let step = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let most = (travel / (4.0 * step).max(travel / (CELLS / 8) as f64)).min(CELLS as f64 / 8.0);
    let mut lines: Vec<(usize, f64)> = spectrum
        .iter()
        .enumerate()
        .map(|(i, c)| (i, c.norm_sqr()))
        .filter(|(i, _)| (tuning().locate.ripple_turns..=most).contains(&turns(*i)))
        .collect();
    let mut powers: Vec<f64> = lines.iter().map(|l| l.1).collect();
    let half = powers.len() / 2;
    if powers.is_empty() {
        return None;
    }
    let median = *powers.select_nth_unstable_by(half, f64::total_cmp).1;
    // Exact least squares about a line, at ever finer steps.
    let fit = |turns: f64| {
        let k = std::f64::consts::TAU * turns / travel;
        let wave = |x: f64| [(k * x).sin(), (k * x).cos()];
        let c = least_squares(x.iter().map(|x| wave(*x)).zip(rest.iter().copied()))?;
        let left: f64 = x.iter().zip(&rest).map(|(x, r)| (r - c[0] * wave(*x)[0] - c[1] * wave(*x)[1]).powi(2)).sum();
        Some((1.0 - left / power, c))
    };
    let mut all: Vec<Ripple> = Vec::new();
    while all.len() < tuning().locate.ripples {
        let Some(peak) = lines.iter().max_by(|a, b| a.1.total_cmp(&b.1)).copied() else { break };
        lines.retain(|line| line.0.abs_diff(peak.0) > OWN_LINES);
        let (mut best, mut width) = (turns(peak.0), 0.5 * turns(1));
        let mut found = fit(best)?;
        for _ in 0..6 {
            for candidate in [best - width, best + width] {
                if let Some(other) = fit(candidate).filter(|o| o.0 > found.0 && candidate > 0.0) {
                    (best, found) = (candidate, other);
                }
            }
            width *= 0.5;
        }
        let [sin, cos] = found.1;
        let prominence = if median > 0.0 { peak.1 / median } else { f64::INFINITY };
        all.push(Ripple { period: travel / best, amplitude: sin.hypot(cos), phase: cos.atan2(sin), share: found.0, prominence });
    }
    Some(all)
}

/// Coefficients of a linear fit of few terms.
pub(super) fn least_squares<const N: usize>(rows: impl Iterator<Item = ([f64; N], f64)>) -> Option<[f64; N]> {
    let mut normal = nalgebra::SMatrix::<f64, N, N>::zeros();
    let mut right = nalgebra::SVector::<f64, N>::zeros();
    for (row, y) in rows {
        let row = nalgebra::SVector::<f64, N>::from(row);
        normal += row * row.transpose();
        right += row * y;
    }
    let ridge = normal.trace() * 1e-13;
    (0..N).for_each(|i| normal[(i, i)] += ridge);
    normal.try_inverse().map(|inverse| (inverse * right).into())
}
