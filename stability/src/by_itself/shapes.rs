//! Two things that a way or a sensor may do to a signal beside a factor and a delay: hold its value between renewals that come too seldom, and filter it.

use backdrive_signal::butterworth::Butterworth;
use backdrive_signal::statistics::rms;
use serde::Serialize;

/// A signal that is renewed at a rate of its own and held in between.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Renewal {
    /// Rows from one renewal to the next; not always a whole number.
    pub rows: f64,
    /// Row of one of them.
    pub phase: f64,
}

impl Renewal {
    /// Whether the value is renewed at a row.
    pub fn is_at(&self, row: f64) -> bool {
        let count = |row: f64| ((row - self.phase + 0.5) / self.rows).floor();
        count(row) > count(row - 1.0)
    }

    /// What becomes of a signal.
    pub fn of(&self, signal: &[f64]) -> Vec<f64> {
        let mut value = signal.first().copied().unwrap_or(f64::NAN);
        let one = |(row, x): (usize, &f64)| {
            if self.is_at(row as f64) && x.is_finite() {
                value = *x;
            }
            value
        };
        signal.iter().enumerate().map(one).collect()
    }
}

/// Fewest renewals that show a rate.
const RENEWALS: usize = 16;

/// Share of the renewals that come in their time: what is lost at random comes at any time.
const IN_TIME: f64 = 0.9;

/// The rate at which a recorded signal is renewed, where that is slower than one row; `None` where it is not, or where renewals come irregularly.
pub(crate) fn renewal(recorded: &[f64], predicted: &[f64]) -> Option<Renewal> {
    let moves = |from: usize, to: usize| {
        let piece = &predicted[from..to.min(predicted.len())];
        piece.windows(2).filter(|w| w[0] != w[1]).count() * 2 > piece.len()
    };
    let mut last = None;
    let mut changes: Vec<usize> = Vec::new();
    for (row, value) in recorded.iter().enumerate().filter(|(_, x)| x.is_finite()) {
        if last.is_some_and(|last| last != *value) {
            changes.push(row);
        }
        last = Some(*value);
    }
    // Where the signal itself rests, no renewal is seen.
    let gaps = || changes.windows(2).filter(|w| moves(w[0], w[1])).map(|w| w[1] - w[0]);
    let mut all: Vec<usize> = gaps().collect();
    if all.len() < RENEWALS {
        return None;
    }
    all.sort_unstable();
    let middle = all[all.len() / 2] as f64;
    if middle < 2.0 {
        return None;
    }
    let steady: Vec<f64> = all.iter().map(|gap| *gap as f64).filter(|gap| (gap - middle).abs() <= 1.0).collect();
    if (steady.len() as f64) < IN_TIME * all.len() as f64 {
        return None;
    }
    // Counted from the middle one, a line through the renewals: missing ones leave their number out.
    let mut rows = steady.iter().sum::<f64>() / steady.len() as f64;
    let anchor = changes[changes.len() / 2] as f64;
    let mut phase = anchor;
    for reach in [40.0, 400.0, f64::INFINITY] {
        let (mut n, mut sk, mut skk, mut sx, mut skx) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for change in changes.iter().map(|c| *c as f64) {
            let k = ((change - phase) / rows).round();
            if (change - phase - k * rows).abs() > 0.75 + 0.1 * rows.min(10.0) || k.abs() > reach {
                continue;
            }
            (n, sk, skk, sx, skx) = (n + 1.0, sk + k, skk + k * k, sx + change, skx + k * change);
        }
        let determinant = n * skk - sk * sk;
        if determinant > 0.0 {
            (rows, phase) = ((n * skx - sk * sx) / determinant, (skk * sx - sk * skx) / determinant);
        }
    }
    // A renewal falls on the first row at or after its time, half a row later on average unless the period is a whole number of rows.
    (rows >= 1.5).then_some(Renewal { rows, phase })
}

/// A low-pass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Filter {
    /// 1 or 2 (Butterworth).
    pub order: usize,
    /// Hz.
    pub corner_hz: f64,
}

impl Filter {
    /// What becomes of a signal that rested at its first value before.
    pub fn of(&self, signal: &[f64], period_s: f64) -> Vec<f64> {
        let mut filter = Butterworth::new(self.order, self.corner_hz, period_s);
        let mut last = signal.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
        let one = |x: &f64| {
            last = if x.is_finite() { *x } else { last };
            filter.step(last)
        };
        signal.iter().map(one).collect()
    }
}

/// Corners that are tried: so many between 1 Hz and a fifth of the rate, then golden sections.
const CORNERS: usize = 18;
const SECTIONS: usize = 14;

/// The low-pass that makes the recorded signal of the predicted one, and the share that it leaves; `scale` is the signal's size.
pub(crate) fn filter(recorded: &[f64], predicted: &[f64], scale: f64, period_s: f64) -> Option<(Filter, f64)> {
    let left = |order: usize, log_hz: f64| {
        let made = Filter { order, corner_hz: log_hz.exp() }.of(predicted, period_s);
        let both = recorded.iter().zip(&made).zip(predicted).filter(|((r, m), p)| r.is_finite() && m.is_finite() && p.is_finite());
        rms(both.map(|((r, m), _)| r - m)) / scale
    };
    let (low, high) = (0.0, (0.2 / period_s).ln());
    if high <= low {
        return None;
    }
    let best = |order: usize| {
        let at = |i: usize| low + (high - low) * i as f64 / (CORNERS - 1) as f64;
        let grid: Vec<f64> = (0..CORNERS).map(|i| left(order, at(i))).collect();
        let first = (0..CORNERS).min_by(|a, b| grid[*a].total_cmp(&grid[*b])).unwrap_or(0);
        let (mut a, mut d) = (at(first.saturating_sub(1)), at((first + 1).min(CORNERS - 1)));
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        for _ in 0..SECTIONS {
            let (b, c) = (d - golden * (d - a), a + golden * (d - a));
            if left(order, b) < left(order, c) { d = c } else { a = b }
        }
        let middle = 0.5 * (a + d);
        (Filter { order, corner_hz: middle.exp() }, left(order, middle))
    };
    [best(1), best(2)].into_iter().min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 2e-4;

    fn signal() -> Vec<f64> {
        (0..10_000)
            .map(|i| {
                let t = f64::from(i) * PERIOD_S;
                (9.0 * t).sin() + 0.4 * (71.0 * t + t * t).sin() + 0.2 * (193.0 * t).sin()
            })
            .collect()
    }

    #[test]
    fn a_signal_that_is_renewed_at_a_rate_of_its_own_is_found_with_its_rate() {
        let x = signal();
        for hz in [30.0, 100.0, 333.0, 1000.0] {
            let rows = 1.0 / (hz * PERIOD_S);
            let mut last = x[0];
            let held: Vec<f64> = (0..x.len())
                .map(|i| {
                    if ((i as f64 - 3.0) / rows).floor() > ((i as f64 - 4.0) / rows).floor() {
                        last = x[i];
                    }
                    last
                })
                .collect();
            let found = renewal(&held, &x).unwrap();
            assert!((found.rows / rows - 1.0).abs() < 2e-3, "{hz}: {found:?}");
            let again = found.of(&x);
            let left = rms(again.iter().zip(&held).map(|(a, b)| a - b)) / rms(&x);
            assert!(left < 0.01, "{hz}: {left}");
        }
        assert_eq!(renewal(&x, &x), None);
        // What is lost at random is no rate.
        let mut seed = 3_u64;
        let mut unit = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let mut last = x[0];
        let lossy: Vec<f64> = x
            .iter()
            .map(|x| {
                if unit() < 0.02 {
                    last = *x;
                }
                last
            })
            .collect();
        assert_eq!(renewal(&lossy, &x), None);
    }

    #[test]
    fn a_low_pass_is_found_with_its_order_and_corner() {
        let x = signal();
        for (order, corner_hz) in [(1, 30.0), (2, 30.0), (1, 5.0), (2, 12.0)] {
            let made = Filter { order, corner_hz }.of(&x, PERIOD_S);
            let (found, left) = filter(&made, &x, rms(&x), PERIOD_S).unwrap();
            assert!(found.order == order && (found.corner_hz / corner_hz - 1.0).abs() < 0.01 && left < 1e-3, "{found:?} {left}");
        }
    }
}
