//! The passivity observer, its trend, and what rounding may make of it.

use super::types::Trend;
use statrs::distribution::ContinuousCDF;
use statrs::distribution::StudentsT;
use std::ops::Range;

/// A passivity observer over a record: energy at each row, the first being 0.
///
/// `force` is held from its row to the next; what is not a number does no work.
pub fn observe_held(force: &[f64], position: &[f64]) -> Vec<f64> {
    observe(force, position, |now, _| now)
}

/// The same for a force that is sampled and not held.
pub fn observe_sampled(force: &[f64], position: &[f64]) -> Vec<f64> {
    observe(force, position, |now, next| 0.5 * (now + next))
}

fn observe(force: &[f64], position: &[f64], mean: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let mut energy = 0.0;
    let rows = force.len().min(position.len());
    let mut series = Vec::with_capacity(rows);
    for row in 0..rows {
        series.push(energy);
        if row + 1 < rows {
            let work = -mean(force[row], force[row + 1]) * (position[row + 1] - position[row]);
            energy += if work.is_finite() { work } else { 0.0 };
        }
    }
    series
}

/// How far rounding the position to `step` may have changed the observer of a held force by each row. Summation by parts gives the effect of the
/// roundings e(k) as -F(n) e(n+1) + F(0) e(0) + sum e(k) (F(k) - F(k-1)). Each e(k) has a standard deviation of step/sqrt(12). J.
pub(super) fn rounding(force: &[f64], step: f64) -> Vec<f64> {
    let (mut squares, mut before, first) = (0.0, f64::NAN, force.iter().copied().find(|f| f.is_finite()).unwrap_or(0.0));
    force
        .iter()
        .map(|now| {
            if now.is_finite() {
                if before.is_finite() {
                    squares += (now - before) * (now - before);
                }
                before = *now;
            }
            let ends = if before.is_finite() { before * before + first * first } else { 0.0 };
            3.0 * step / 12.0_f64.sqrt() * (squares + ends).sqrt()
        })
        .collect()
}

/// Pieces of the holds, from whose scatter a trend's interval comes.
const PIECES: usize = 8;

/// Mean power over pieces of equal length of all holds, with its 95 % interval (Student).
pub(super) fn trend(series: &[f64], holds: &[Range<usize>], period_s: f64) -> Option<Trend> {
    let whole: usize = holds.iter().map(|h| h.end - h.start).sum();
    let length = whole / PIECES;
    if length < 2 {
        return None;
    }
    let mut powers = Vec::new();
    for hold in holds {
        let mut from = hold.start;
        while from + length < hold.end.min(series.len()) {
            powers.push((series[from + length] - series[from]) / (length as f64 * period_s));
            from += length;
        }
    }
    let n = powers.len() as f64;
    if powers.len() < 3 {
        return None;
    }
    let mean_w = powers.iter().sum::<f64>() / n;
    let variance = powers.iter().map(|p| (p - mean_w).powi(2)).sum::<f64>() / (n - 1.0);
    let quantile = StudentsT::new(0.0, 1.0, n - 1.0).map_or(2.5, |t| t.inverse_cdf(0.975));
    Some(Trend { mean_w, half_width_w: quantile * (variance / n).sqrt() })
}

/// Points of a plotted series, about.
const POINTS: usize = 1000;

pub(super) fn decimate(series: &[f64]) -> Vec<f64> {
    let every = series.len().div_ceil(POINTS).max(1);
    let mut points: Vec<f64> = series.iter().step_by(every).copied().collect();
    if let Some(last) = series.last().filter(|_| !(series.len() - 1).is_multiple_of(every)) {
        points.push(*last);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::elements::HystereticSpring;
    use backdrive_plant::elements::PathLaw;

    /// A wall of stiffness k, sampled every T and held, and a hand that moves by x(t). Over closed cycles the wall delivers exactly k/2 sum (dx)^2,
    /// which is k T/2 times the integral of v^2 except for terms of order T^2.
    #[test]
    fn a_sampled_wall_gives_k_t_half_v_squared() {
        let (k, period_s, hz, amplitude, cycles) = (2000.0, 1e-3, 3.0, 4e-3, 6);
        let w = 2.0 * std::f64::consts::PI * hz;
        let rows = (f64::from(cycles) / hz / period_s).round() as usize;
        let x: Vec<f64> = (0..=rows).map(|i| amplitude * (w * i as f64 * period_s).sin()).collect();
        let force: Vec<f64> = x.iter().map(|x| -k * x).collect();
        let end = *observe_held(&force, &x).last().unwrap();
        let exact = -0.5 * k * x.windows(2).map(|p| (p[1] - p[0]).powi(2)).sum::<f64>();
        assert!((end - exact).abs() < 1e-12, "{end} {exact}");
        let formula = -k * period_s / 2.0 * (amplitude * w).powi(2) / 2.0 * f64::from(cycles) / hz;
        assert!((end / formula - 1.0).abs() < 1e-4, "{end} {formula}");
        // The trapezium is exact for a spring: a port that is sampled and not held neither takes nor gives.
        assert!(observe_sampled(&force, &x).last().unwrap().abs() < 1e-12);
        // A damper of K T/2 in the master takes just that: Colgate's bound.
        let damper: Vec<f64> = x.windows(2).map(|p| k * period_s / 2.0 * ((p[1] - p[0]) / period_s).powi(2) * period_s).collect();
        assert!((end + damper.iter().sum::<f64>()).abs() < 1e-12);
    }

    /// Check 6 of the main paper: beyond x* = (f_n - f_p)/(k_p - k_n), where the two lines of the hysteretic spring cross, a cycle
    /// gives energy. The observer at its port shows it, and the place where the loop's sign turns is x*.
    #[test]
    fn a_hysteretic_spring_beyond_its_crossing_is_seen_to_give_energy() {
        let (kp, kn, fp, fn_, gamma) = (3900.0, 4000.0, 0.465, -0.465, 8500.0);
        let law = HystereticSpring {
            stiffness_positive: kp,
            stiffness_negative: kn,
            offset_positive: fp,
            offset_negative: fn_,
            bandwidth: gamma,
        };
        // Energy that a cycle of 1 mm about a place takes, by the observer, once it is steady.
        let cycle = |about: f64| {
            let mut memory = vec![0.0; law.memory_len()];
            let steps = 8000;
            let x = |i: usize| about * (i as f64 / 1000.0).min(1.0) + 1e-3 * (2.0 * std::f64::consts::PI * i as f64 / steps as f64).sin();
            let (mut position, mut force) = (Vec::new(), Vec::new());
            let mut before = 0.0;
            for i in 0..4 * steps {
                let now = x(i);
                law.advance(&mut memory, before, now, 1e-4);
                force.push(-law.force(&memory, now, 0.0));
                position.push(now);
                before = now;
            }
            let energy = observe_sampled(&force, &position);
            energy[4 * steps - 1] - energy[3 * steps - 1]
        };
        let crossing = (fn_ - fp) / (kp - kn);
        assert!((crossing - 9.3e-3).abs() < 1e-12);
        assert!(cycle(0.7 * crossing) > 0.0 && cycle(11e-3) < -1e-5, "{} {}", cycle(0.7 * crossing), cycle(11e-3));
        let (mut low, mut high) = (0.7 * crossing, 1.3 * crossing);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if cycle(middle) > 0.0 { low = middle } else { high = middle }
        }
        assert!((low / crossing - 1.0).abs() < 0.01, "{low} instead of {crossing}");
    }

    #[test]
    fn rounding_is_seen_and_not_taken_for_energy() {
        let step = 2e-6;
        let round = |x: f64| (x / step).round() * step;
        let x: Vec<f64> = (0..20_000).map(|i| 1e-3 + 1e-5 * (i as f64 * 0.0137).sin()).collect();
        let force: Vec<f64> = x.iter().enumerate().map(|(i, _)| -1.0 - 0.01 * (i as f64 * 0.311).cos()).collect();
        let rounded: Vec<f64> = x.iter().map(|x| round(*x)).collect();
        let (exact, seen) = (observe_held(&force, &x), observe_held(&force, &rounded));
        let allowed = rounding(&force, step);
        let beyond = exact.iter().zip(&seen).zip(&allowed).filter(|((e, s), a)| (*e - *s).abs() > **a).count();
        assert!(beyond * 100 < exact.len(), "{beyond}");
        assert!(*allowed.last().unwrap() < 1e-3 * 1.0 * 1e-2, "the allowance is no blank cheque: {}", allowed.last().unwrap());
    }

    #[test]
    fn a_trend_has_an_interval() {
        let series: Vec<f64> = (0..8000).map(|i| -2e-3 * i as f64 * 1e-3 + 1e-5 * (i as f64 * 0.3).sin()).collect();
        let found = trend(&series, &[1000..4000, 5000..8000], 1e-3).unwrap();
        assert!((found.mean_w + 2e-3).abs() < 3.0 * found.half_width_w && found.half_width_w < 1e-4, "{found:?}");
        assert_eq!(trend(&series, &[], 1e-3), None);
    }
}
