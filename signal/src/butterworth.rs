//! A causal Butterworth low-pass, as second-order sections.

use std::f64::consts::PI;

/// Highest order.
pub const MOST_ORDER: usize = 8;

/// Numerator b0..b2 and denominator a1, a2 of a section, and what it remembers (transposed direct form II).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
    kept: [f64; 2],
}

/// The filter in time. Its first sample puts it at rest on that value.
#[derive(Debug, Clone, PartialEq)]
pub struct Butterworth {
    sections: Vec<Section>,
    begun: bool,
}

impl Butterworth {
    /// Order 1 to [`MOST_ORDER`] (cut to it), corner in Hz (-3 dB) below half the rate. A corner that is not above 0 or not below half the rate lets
    /// everything pass. The bilinear image, with the corner kept where it is.
    pub fn new(order: usize, corner_hz: f64, period_s: f64) -> Butterworth {
        let order = order.clamp(1, MOST_ORDER);
        let mut sections = Vec::new();
        if corner_hz > 0.0 && corner_hz * period_s < 0.5 {
            let w = (PI * corner_hz * period_s).tan();
            for pair in 0..order / 2 {
                // Poles of the prototype at exp(i (pi/2 + (2 pair + 1) pi / (2 order))).
                let damping = 2.0 * (PI * (2 * pair + 1) as f64 / (2 * order) as f64).sin();
                let norm = 1.0 + damping * w + w * w;
                let b = w * w / norm;
                sections.push(Section {
                    b: [b, 2.0 * b, b],
                    a: [2.0 * (w * w - 1.0) / norm, (1.0 - damping * w + w * w) / norm],
                    kept: [0.0; 2],
                });
            }
            if order % 2 == 1 {
                let b = w / (1.0 + w);
                sections.push(Section { b: [b, b, 0.0], a: [(w - 1.0) / (1.0 + w), 0.0], kept: [0.0; 2] });
            }
        }
        Butterworth { sections, begun: false }
    }

    /// Whether every signal passes unchanged.
    pub fn passes_all(&self) -> bool {
        self.sections.is_empty()
    }

    /// The next filtered sample.
    pub fn step(&mut self, sample: f64) -> f64 {
        if !self.begun {
            self.begun = true;
            for s in &mut self.sections {
                // At rest in and out are the sample.
                s.kept[1] = (s.b[2] - s.a[1]) * sample;
                s.kept[0] = (s.b[1] - s.a[0]) * sample + s.kept[1];
            }
        }
        self.sections.iter_mut().fold(sample, |x, s| {
            let y = s.b[0] * x + s.kept[0];
            s.kept[0] = s.b[1] * x - s.a[0] * y + s.kept[1];
            s.kept[1] = s.b[2] * x - s.a[1] * y;
            y
        })
    }
}

/// A signal forward and backward through a filter that has not begun, which begins at rest on the first value of each way. Nothing is delayed, and the
/// response counts twice.
pub fn both_ways(filter: &Butterworth, signal: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let (mut there, mut back) = (filter.clone(), filter.clone());
    let mut values: Vec<f64> = signal.into_iter().map(|x| there.step(x)).collect();
    values.iter_mut().rev().for_each(|x| *x = back.step(*x));
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Amplitude of the answer to a sine, over ten settled seconds of whole cycles.
    fn answer(order: usize, corner: f64, hz: f64) -> f64 {
        let period = 1e-3;
        let mut filter = Butterworth::new(order, corner, period);
        let answers: Vec<f64> = (0..20_000).map(|k| filter.step((TAU * hz * k as f64 * period).sin())).collect();
        (answers[10_000..].iter().map(|y| y * y).sum::<f64>() / 5_000.0).sqrt()
    }

    #[test]
    fn the_magnitude_is_that_of_its_closed_form() {
        for order in 1..=5 {
            for hz in [3.0_f64, 20.0, 33.0] {
                // With the frequency warped as the bilinear image does.
                let ratio = (PI * hz * 1e-3).tan() / (PI * 20.0 * 1e-3).tan();
                let expected = 1.0 / (1.0 + ratio.powi(2 * order as i32)).sqrt();
                assert!((answer(order, 20.0, hz) - expected).abs() < 1e-6, "order {order} at {hz} Hz");
            }
        }
    }

    /// Product of polynomials in the delay.
    fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; a.len() + b.len() - 1];
        for (i, x) in a.iter().enumerate() {
            for (j, y) in b.iter().enumerate() {
                out[i + j] += x * y;
            }
        }
        out
    }

    #[test]
    fn the_fourth_order_at_a_fifth_of_half_the_rate_has_the_coefficients_of_the_tables() {
        // Butterworth, order 4, corner 0.2 of half the rate; by the bilinear transform of the analogue poles.
        let b = [0.004824343357716228, 0.019297373430864913, 0.02894606014629737, 0.019297373430864913, 0.004824343357716228];
        let a = [1.0, -2.3695130071820376, 2.31398841441588, -1.0546654058785676, 0.18737949236818494];
        let (mut num, mut den) = (vec![1.0], vec![1.0]);
        for s in &Butterworth::new(4, 100.0, 1e-3).sections {
            num = product(&num, &s.b);
            den = product(&den, &[1.0, s.a[0], s.a[1]]);
        }
        for (found, exact) in num.iter().zip(b).chain(den.iter().zip(a)) {
            assert!((found - exact).abs() < 1e-12, "{found} {exact}");
        }
    }

    #[test]
    fn both_ways_delay_nothing() {
        let sine: Vec<f64> = (0..4000).map(|k| (k as f64 * 0.01).sin()).collect();
        let smoothed = both_ways(&Butterworth::new(2, 50.0, 1e-3), sine.iter().copied());
        let worst = sine.iter().zip(&smoothed).skip(500).take(3000).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-3, "{worst}");
    }

    #[test]
    fn it_begins_at_rest_and_a_corner_that_is_none_lets_everything_pass() {
        let mut filter = Butterworth::new(3, 10.0, 1e-3);
        assert!((0..100).all(|_| (filter.step(5.0) - 5.0).abs() < 1e-12));
        assert_eq!(Butterworth::new(2, 0.0, 1e-3).step(3.0), 3.0);
        assert_eq!(Butterworth::new(2, 600.0, 1e-3).step(3.0), 3.0);
    }
}
