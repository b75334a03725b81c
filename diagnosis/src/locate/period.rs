//! Does a force repeat with position? A spectrum over displacement.

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
/// Passes over the travel that a ripple must make at least to be told from a trend.
const FEWEST_TURNS: f64 = 2.0;

/// The strongest ripple of `force` over `x`; `None` where nothing moves.
pub fn scan(x: &[f64], force: &[f64]) -> Option<Ripple> {
    let n = x.len().min(force.len());
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let travel = high - low;
    if n < 16 || !(travel.is_finite() && travel > 0.0) {
        return None;
    }
    // The slow course over displacement goes first: a polynomial through the forces.
    let unit: Vec<f64> = x.iter().map(|x| 2.0 * (x - low) / travel - 1.0).collect();
    let basis = |u: f64| [1.0, u, u * u, u * u * u];
    let slow = least_squares(unit.iter().map(|u| basis(*u)).zip(force.iter().copied()))?;
    let rest: Vec<f64> = unit.iter().zip(force).map(|(u, f)| f - basis(*u).iter().zip(&slow).map(|(b, c)| b * c).sum::<f64>()).collect();
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
    // Finer than what a step from sample to sample passes over, nothing can be told.
    let mut steps: Vec<f64> = x.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let middle = steps.len() / 2;
    let step = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let most = (travel / (4.0 * step).max(travel / (CELLS / 8) as f64)).min(CELLS as f64 / 8.0);
    let lines: Vec<(usize, f64)> =
        spectrum.iter().enumerate().map(|(i, c)| (i, c.norm_sqr())).filter(|(i, _)| (FEWEST_TURNS..=most).contains(&turns(*i))).collect();
    let peak = lines.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut powers: Vec<f64> = lines.iter().map(|l| l.1).collect();
    let half = powers.len() / 2;
    let median = *powers.select_nth_unstable_by(half, f64::total_cmp).1;
    // Exact least squares about the line, at ever finer steps.
    let fit = |turns: f64| {
        let k = std::f64::consts::TAU * turns / travel;
        let wave = |x: f64| [(k * x).sin(), (k * x).cos()];
        let c = least_squares(x.iter().map(|x| wave(*x)).zip(rest.iter().copied()))?;
        let left: f64 = x.iter().zip(&rest).map(|(x, r)| (r - c[0] * wave(*x)[0] - c[1] * wave(*x)[1]).powi(2)).sum();
        Some((1.0 - left / power, c))
    };
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
    Some(Ripple { period: travel / best, amplitude: sin.hypot(cos), phase: cos.atan2(sin), share: found.0, prominence })
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
