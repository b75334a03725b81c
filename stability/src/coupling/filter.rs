//! Delays, filtered rates and zero-phase low-passes of sampled signals.

use backdrive_signal::butterworth::{Butterworth, both_ways};

/// The signal delayed by `rows` samples, by the cubic through its four neighbours; `rows` may be negative. Beyond its ends the signal keeps its end
/// value.
pub(super) fn delayed(signal: &[f64], rows: f64) -> Vec<f64> {
    let last = signal.len() as i64 - 1;
    let at = |row: i64| signal.get(row.clamp(0, last.max(0)) as usize).copied().unwrap_or(0.0);
    let whole = rows.ceil();
    // How far behind the earlier neighbour it is, 0 to 1.
    let part = whole - rows;
    let (a, b, c, d) = (
        -part * (part - 1.0) * (part - 2.0) / 6.0,
        (part + 1.0) * (part - 1.0) * (part - 2.0) / 2.0,
        -(part + 1.0) * part * (part - 2.0) / 2.0,
        (part + 1.0) * part * (part - 1.0) / 6.0,
    );
    let whole = whole as i64;
    (0..=last).map(|k| a * at(k - whole - 1) + b * at(k - whole) + c * at(k - whole + 1) + d * at(k - whole + 2)).collect()
}

/// The rate of a signal behind a low-pass of first order, `s/(1 + s filter_s)`: exact for a signal that runs straight between its samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct FilteredRate {
    keep: f64,
    now: f64,
    before: f64,
    filter_s: f64,
    state: Option<(f64, f64)>,
}

impl FilteredRate {
    /// With the low-pass's time constant and the sample time, s.
    pub(super) fn new(filter_s: f64, period_s: f64) -> FilteredRate {
        let keep = (-period_s / filter_s).exp();
        let share = filter_s / period_s * (1.0 - keep);
        FilteredRate { keep, now: 1.0 - share, before: share - keep, filter_s, state: None }
    }

    /// The rate at the next sample; 0 at the first.
    pub(super) fn step(&mut self, x: f64) -> f64 {
        let (before, smooth) = self.state.unwrap_or((x, x));
        let smooth = self.keep * smooth + self.now * x + self.before * before;
        self.state = Some((x, smooth));
        (x - smooth) / self.filter_s
    }

    /// Of a whole signal.
    pub(super) fn of(signal: &[f64], filter_s: f64, period_s: f64) -> Vec<f64> {
        let mut filter = FilteredRate::new(filter_s, period_s);
        signal.iter().map(|x| filter.step(*x)).collect()
    }
}

/// A Butterworth low-pass of second order run forward and backward, so that nothing is delayed; half of the amplitude passes at its corner.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BothWays {
    corner_hz: f64,
    period_s: f64,
}

impl BothWays {
    /// With its corner, Hz; `None` where that lies so near half the sample rate that nothing would be left out.
    pub(crate) fn new(corner_hz: f64, period_s: f64) -> Option<BothWays> {
        (corner_hz * period_s <= 0.4).then_some(BothWays { corner_hz, period_s })
    }

    /// The signal filtered.
    pub(crate) fn of(self, signal: &[f64]) -> Vec<f64> {
        both_ways(&Butterworth::new(2, self.corner_hz, self.period_s), signal.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const PERIOD: f64 = 1e-3;

    fn wave(hz: f64) -> impl Fn(f64) -> f64 {
        move |t| (2.0 * PI * hz * t).sin()
    }

    fn sampled(f: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..4000).map(|k| f(f64::from(k) * PERIOD)).collect()
    }

    #[test]
    fn a_delay_of_any_length_either_way_moves_a_wave() {
        let wave = wave(30.0);
        for rows in [0.0, 0.3, 1.0, 7.75, -1.4] {
            let moved = delayed(&sampled(&wave), rows);
            for k in 20..3980 {
                assert!((moved[k] - wave((k as f64 - rows) * PERIOD)).abs() < 2e-4, "{rows} {k}");
            }
        }
    }

    #[test]
    fn a_filtered_rate_has_the_response_of_its_formula() {
        let (hz, filter) = (40.0, 2e-3);
        let w = 2.0 * PI * hz;
        let rate = FilteredRate::of(&sampled(wave(hz)), filter, PERIOD);
        let (gain, phase) = (w / (1.0 + (w * filter).powi(2)).sqrt(), PI / 2.0 - (w * filter).atan());
        for k in 500..3500 {
            let expected = gain * (w * k as f64 * PERIOD + phase).sin();
            assert!((rate[k] - expected).abs() < 0.02 * gain, "{k}: {} {expected}", rate[k]);
        }
        // Without a filter to speak of it is the difference.
        let line: Vec<f64> = (0..10).map(|k| 3.0 * f64::from(k) * PERIOD).collect();
        assert!((FilteredRate::of(&line, 1e-9, PERIOD)[5] - 3.0).abs() < 1e-6);
    }

    #[test]
    fn both_ways_halves_at_the_corner_and_delays_nothing() {
        let filter = BothWays::new(50.0, PERIOD).unwrap();
        let (slow, corner) = (filter.of(&sampled(wave(5.0))), filter.of(&sampled(wave(50.0))));
        for k in 500..3500 {
            let t = k as f64 * PERIOD;
            assert!((slow[k] - wave(5.0)(t)).abs() < 1e-3 && (corner[k] - 0.5 * wave(50.0)(t)).abs() < 1e-6);
        }
        assert!(BothWays::new(450.0, PERIOD).is_none());
    }
}
