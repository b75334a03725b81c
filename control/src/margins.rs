//! The stability margins of a loop, from a frequency response, pure and without allocation.
//!
//! `L` is the transfer once round the loop, of a closed loop `F_f = d + L F_f`. The critical point is `+1`, on the positive real axis, at any
//! frequency and also at DC, where a loop of positive feedback runs away without oscillating. All functions take lines of rising frequency, Hz; lines
//! that are not finite are passed over. Between lines, `L` is interpolated in the logarithm of its magnitude and in its phase, which is exact for a
//! pure delay.

use nalgebra::Complex;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Where `k L` passes through `+1`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Crossing {
    /// The factor `k` by which the gain may be multiplied until the loop is at its stability limit, above 0.
    pub factor: f64,
    /// Hz; 0 for a loop that runs away without oscillating.
    pub frequency_hz: f64,
}

/// The margins of a loop at the gain at which `L` is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Margins {
    /// By how much the gain may rise, dB; negative where the loop is above its stability limit; `None` where no gain reaches it.
    pub gain_db: Option<f64>,
    /// Smallest angle of `L` from `+1` where `|L| = 1`, degrees; negative above the stability limit; `None` where `|L|` never is 1.
    pub phase_deg: Option<f64>,
    /// Smallest extra loop delay that makes it unstable, ms; 0 above the stability limit; `None` where no delay does.
    pub delay_ms: Option<f64>,
    /// Smallest `|1 - L|`: 1 over the peak of the sensitivity.
    pub modulus: f64,
    /// The stability limit: the smallest factor on the gain at which the loop is no longer stable.
    pub critical: Option<Crossing>,
}

/// Phase of the lowest line within which it counts as the continuation of a positive `L(0)`, rad.
const NEAR_DC: f64 = PI / 4.0;

fn finite(z: &Complex<f64>) -> bool {
    z.re.is_finite() && z.im.is_finite()
}

/// The lines that can be used: finite, of finite frequency not below 0.
fn lines<'a>(hz: &'a [f64], l: &'a [Complex<f64>]) -> impl Iterator<Item = (f64, Complex<f64>)> + 'a {
    hz.iter().copied().zip(l.iter().copied()).filter(|(f, z)| f.is_finite() && *f >= 0.0 && finite(z))
}

/// Neighbouring lines in pairs.
fn spans<'a>(hz: &'a [f64], l: &'a [Complex<f64>]) -> impl Iterator<Item = ((f64, Complex<f64>), (f64, Complex<f64>))> + 'a {
    lines(hz, l).zip(lines(hz, l).skip(1))
}

/// `L(0)`, which is real, continued from the two lowest lines; `None` without lines.
///
/// A lowest line far from the real axis continues an integrator, `L = -K/s` above it and `L = K/s` below. The value at DC then has the sign of the
/// path round the pole, and the size of the lowest line.
fn at_dc(hz: &[f64], l: &[Complex<f64>]) -> Option<f64> {
    let mut lowest = lines(hz, l);
    let (f0, l0) = lowest.next()?;
    if l0.norm_sqr() == 0.0 {
        return Some(0.0);
    }
    if l0.im.abs() > l0.re.abs() {
        return Some(-l0.norm().copysign(l0.im));
    }
    Some(continued((f0, l0), lowest.next()))
}

/// `L(0)` from the two lowest lines: by `Re 1/L`, which is even in frequency, and of a single lag the same at all of them.
fn continued((f0, l0): (f64, Complex<f64>), next: Option<(f64, Complex<f64>)>) -> f64 {
    let inverse = |l: Complex<f64>| l.re / l.norm_sqr();
    let lowest = inverse(l0);
    let Some((f1, l1)) = next.filter(|(f1, l1)| f0 > 0.0 && *f1 > f0 && l1.norm_sqr() > 0.0) else { return 1.0 / lowest };
    let change = (lowest - inverse(l1)) * f0 * f0 / (f1 * f1 - f0 * f0);
    // No more than half of the value itself: two lines far from DC do not determine more.
    1.0 / (lowest + change.clamp(-0.5 * lowest.abs(), 0.5 * lowest.abs()))
}

/// The crossing at DC that the lowest line, (Hz, L), and the one above it imply: where `L(0)` is positive the loop runs away without oscillating at
/// `1 / L(0)`.
pub fn at_the_bottom(lowest: (f64, Complex<f64>), next: Option<(f64, Complex<f64>)>) -> Option<Crossing> {
    let (f0, l0) = lowest;
    if !(l0.re > 0.0 && l0.arg().abs() < NEAR_DC) {
        return None;
    }
    let next = next.filter(|(f1, l1)| f1.is_finite() && finite(l1));
    let factor = 1.0 / continued((f0, l0), next);
    (factor > 0.0 && factor.is_finite()).then_some(Crossing { factor, frequency_hz: 0.0 })
}

/// The crossing of the positive real axis between two neighbouring lines, (Hz, L) each.
pub fn between((f0, l0): (f64, Complex<f64>), (f1, l1): (f64, Complex<f64>)) -> Option<Crossing> {
    if l0.norm_sqr() == 0.0 || l1.norm_sqr() == 0.0 {
        return None;
    }
    let (from, turn) = (l0.arg(), (l1 / l0).arg());
    let to = from + turn;
    // A line that lies on the axis belongs to the span that it begins.
    if turn == 0.0 || !((from <= 0.0 && to > 0.0) || (from >= 0.0 && to < 0.0)) {
        return None;
    }
    let share = (-from / turn).clamp(0.0, 1.0);
    let factor = (-l0.norm().ln() * (1.0 - share) - l1.norm().ln() * share).exp();
    factor.is_finite().then_some(Crossing { factor, frequency_hz: f0 + share * (f1 - f0) })
}

/// Every place where a multiple of `L` passes through `+1`: crossings of the positive real axis, and DC.
fn crossings<'a>(hz: &'a [f64], l: &'a [Complex<f64>]) -> impl Iterator<Item = Crossing> + 'a {
    let dc = lines(hz, l).next().and_then(|lowest| at_the_bottom(lowest, lines(hz, l).nth(1)));
    dc.into_iter().chain(spans(hz, l).filter_map(|(a, b)| between(a, b)))
}

/// The smallest `k > 0` at which `k L` passes through `+1`: for a loop that is stable open, the stability limit.
///
/// `hz` rises; `l` is `L` at each. `None` where no gain reaches the stability limit within the lines.
pub fn critical_factor(hz: &[f64], l: &[Complex<f64>]) -> Option<Crossing> {
    crossings(hz, l).min_by(|a, b| a.factor.total_cmp(&b.factor))
}

/// Whether the closed loop is stable, by Nyquist's criterion: `1 - L` does not wind about 0 between DC and the last line.
///
/// `L` must be stable open, and the lowest line below all its dynamics. The lines must be so close that it turns by less than half a circle about `+1` from
/// one to the next. A loop that is stable only between two gains is judged at its own gain. Without lines it is stable: nothing is fed back.
pub fn is_stable(hz: &[f64], l: &[Complex<f64>]) -> bool {
    let one = Complex::new(1.0, 0.0);
    let (Some(dc), Some((_, last))) = (at_dc(hz, l), lines(hz, l).last()) else { return true };
    let mut winding = 0.0;
    // L is real at DC and at the Nyquist frequency.
    let mut before = one - dc;
    let end = Complex::new(1.0 - last.re, 0.0);
    for now in lines(hz, l).map(|(_, l)| one - l).chain([end]) {
        if before.norm_sqr() == 0.0 || now.norm_sqr() == 0.0 {
            return false;
        }
        winding += (now / before).arg();
        before = now;
    }
    winding.abs() < 0.5 * PI
}

/// The margins of a loop; see [`Margins`].
pub fn margins(hz: &[f64], l: &[Complex<f64>]) -> Margins {
    let stable = is_stable(hz, l);
    let critical = critical_factor(hz, l);
    let upwards = crossings(hz, l).map(|c| c.factor).filter(|k| *k >= 1.0).min_by(f64::total_cmp);
    let factor = if stable { upwards } else { critical.map(|c| c.factor) };
    let (mut phase, mut delay) = (f64::INFINITY, f64::INFINITY);
    for ((f0, l0), (f1, l1)) in spans(hz, l) {
        let (size0, size1) = (l0.norm(), l1.norm());
        if size0 == 0.0 || size1 == 0.0 || (size0 < 1.0) == (size1 < 1.0) {
            continue;
        }
        let share = (size0.ln() / (size0.ln() - size1.ln())).clamp(0.0, 1.0);
        let angle = l0.arg() + share * (l1 / l0).arg();
        let hz = f0 + share * (f1 - f0);
        phase = phase.min(angle.rem_euclid(TAU).min((-angle).rem_euclid(TAU)));
        if hz > 0.0 {
            delay = delay.min(angle.rem_euclid(TAU) / (TAU * hz));
        }
    }
    let sign = if stable { 1.0 } else { -1.0 };
    Margins {
        gain_db: factor.map(|k| 20.0 * k.log10()),
        phase_deg: phase.is_finite().then(|| sign * phase.to_degrees()),
        delay_ms: if stable { delay.is_finite().then_some(delay * 1e3) } else { Some(0.0) },
        modulus: modulus(hz, l),
        critical,
    }
}

/// Smallest distance of the curve from `+1`; 1 where there is no line.
fn modulus(hz: &[f64], l: &[Complex<f64>]) -> f64 {
    let one = Complex::new(1.0, 0.0);
    let at_lines = lines(hz, l).map(|(_, l)| (one - l).norm());
    let between = spans(hz, l).map(|((_, l0), (_, l1))| {
        let way = l1 - l0;
        let share = if way.norm_sqr() > 0.0 { ((one - l0) * way.conj()).re / way.norm_sqr() } else { 0.0 };
        (one - l0 - way * share.clamp(0.0, 1.0)).norm()
    });
    let real = lines(hz, l).next().is_some_and(|(_, l0)| l0.im.abs() <= l0.re.abs());
    let dc = at_dc(hz, l).filter(|_| real).map(|x| (1.0 - x).abs());
    at_lines.chain(between).chain(dc).min_by(f64::total_cmp).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(from: f64, to: f64, step: f64) -> Vec<f64> {
        (0..).map(|i| from + step * f64::from(i)).take_while(|f| *f <= to).collect()
    }

    fn response(hz: &[f64], l: impl Fn(Complex<f64>) -> Complex<f64>) -> Vec<Complex<f64>> {
        hz.iter().map(|f| l(Complex::new(0.0, TAU * f))).collect()
    }

    /// `L = -K e^{-s T} / s`: at the stability limit at `w = pi / (2 T)`, for `K = pi / (2 T)`.
    #[test]
    fn an_integrator_with_delay_has_its_closed_form() {
        let (delay, gain) = (0.004, 100.0);
        let hz = grid(0.5, 200.0, 0.5);
        let l = response(&hz, |s| -gain * (-s * delay).exp() / s);
        let edge = critical_factor(&hz, &l).unwrap();
        let exact = PI / (2.0 * delay) / gain;
        assert!((edge.factor / exact - 1.0).abs() < 1e-4, "{edge:?} {exact}");
        assert!((edge.frequency_hz - 62.5).abs() < 0.01, "{edge:?}");
        let found = margins(&hz, &l);
        assert!((found.gain_db.unwrap() - 20.0 * exact.log10()).abs() < 1e-3);
        // |L| = 1 at w = K, where the angle from +1 is pi/2 - K T.
        let phase = 0.5 * PI - gain * delay;
        assert!((found.phase_deg.unwrap() - phase.to_degrees()).abs() < 0.01, "{found:?}");
        assert!((found.delay_ms.unwrap() / (phase / gain * 1e3) - 1.0).abs() < 1e-3, "{found:?}");
        for (k, stable) in [(0.5, true), (0.98, true), (1.02, false), (3.0, false)] {
            let scaled: Vec<_> = l.iter().map(|l| l * (k * exact)).collect();
            assert_eq!(is_stable(&hz, &scaled), stable, "at {k} of the edge");
            let at = margins(&hz, &scaled);
            assert_eq!(at.gain_db.unwrap() > 0.0, stable);
            assert_eq!(at.phase_deg.unwrap() > 0.0, stable);
            assert_eq!(at.delay_ms.unwrap() > 0.0, stable);
        }
    }

    /// A hand on a spring against a wall, `L = -k G(s) e^{-s T}`: the stability limit solves `arg G - w T = -pi`.
    #[test]
    fn a_second_order_loop_with_delay_has_its_closed_form() {
        let (mass, damping, stiffness, delay, wall) = (0.03, 3.0, 4000.0, 0.002, 500.0);
        let g = |s: Complex<f64>| Complex::new(1.0, 0.0) / (s * s * mass + s * damping + stiffness);
        let hz = grid(0.5, 400.0, 0.5);
        let l = response(&hz, |s| -wall * g(s) * (-s * delay).exp());
        let edge = critical_factor(&hz, &l).unwrap();
        let (mut low, mut high) = (50.0, 200.0);
        let lag = |f: f64| -g(Complex::new(0.0, TAU * f)).arg() + TAU * f * delay;
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if lag(middle) < PI { low = middle } else { high = middle }
        }
        let exact = 1.0 / (wall * g(Complex::new(0.0, TAU * low)).norm());
        assert!((edge.frequency_hz - low).abs() < 0.01, "{edge:?} {low}");
        assert!((edge.factor / exact - 1.0).abs() < 5e-4, "{edge:?} {exact}");
        let at = |k: f64| is_stable(&hz, &l.iter().map(|l| l * k).collect::<Vec<_>>());
        assert!(at(0.99 * exact) && !at(1.01 * exact));
    }

    #[test]
    fn over_cancelling_runs_away_at_dc() {
        let hz = grid(1.0, 300.0, 1.0);
        let l = response(&hz, |s| 0.25 / (Complex::new(1.0, 0.0) + s / 60.0).powi(2));
        let edge = critical_factor(&hz, &l).unwrap();
        assert_eq!(edge.frequency_hz, 0.0);
        assert!((edge.factor - 4.0).abs() < 0.01, "{edge:?}");
        let at = |k: f64| is_stable(&hz, &l.iter().map(|l| l * k).collect::<Vec<_>>());
        assert!(at(3.9) && !at(4.1));
        assert!((margins(&hz, &l).modulus - 0.75).abs() < 0.01);
        // A single lag of 2.5 Hz, which two lines below the corner determine.
        let l = response(&hz, |s| 0.25 / (Complex::new(1.0, 0.0) + s / (TAU * 2.5)));
        assert!((critical_factor(&hz, &l).unwrap().factor - 4.0).abs() < 1e-9);
    }

    /// `-K (s + 30)^2 / s^3`, stable only above `K = 15` (Routh: `2 K 30 > 900`, that is `K > 15`).
    #[test]
    fn a_conditionally_stable_loop_is_judged_by_its_winding() {
        let hz: Vec<f64> = (0..6000).map(|i| 0.002 * 1.003_f64.powi(i)).take_while(|f| *f < 2000.0).collect();
        // Three slow poles in place of the integrators, so that the loop is stable open.
        let l = |k: f64| response(&hz, |s| -k * (s + 30.0).powi(2) / (s + 0.3).powi(3));
        // Exact: roots of (s + 0.3)^3 + K (s + 30)^2.
        let stable = |k: f64| {
            let (a2, a1, a0) = (0.9 + k, 0.27 + 60.0 * k, 0.027 + 900.0 * k);
            a2 * a1 > a0
        };
        for k in [1e-7, 1e-5, 1.0, 5.0, 10.0, 20.0, 50.0] {
            assert_eq!(is_stable(&hz, &l(k)), stable(k), "K = {k}");
        }
        assert!(stable(1e-7) && !stable(5.0) && stable(20.0));
        let found = margins(&hz, &l(20.0));
        assert!(found.critical.unwrap().factor < 1.0, "it was unstable in between: {found:?}");
        assert_eq!(found.gain_db, None, "{found:?}");
        assert!(found.phase_deg.unwrap() > 0.0);
    }

    #[test]
    fn nothing_and_what_is_not_finite_is_answered() {
        assert_eq!(critical_factor(&[], &[]), None);
        assert!(is_stable(&[], &[]));
        let broken = [Complex::new(f64::NAN, 0.0), Complex::new(-1.0, 0.0), Complex::new(f64::INFINITY, 0.0)];
        assert_eq!(margins(&[1.0, 2.0, 3.0], &broken).critical, None);
        assert_eq!(critical_factor(&[1.0, 2.0], &[Complex::new(0.0, 0.0); 2]), None);
    }
}
