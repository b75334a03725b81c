//! How an input runs between its samples.

use super::segment::Segment;
use crate::model::Hold;

/// The N - 1 segments between N samples `period` seconds apart.
///
/// `Hold::Cubic` is the spline through all samples whose third derivative does not jump at the second and the
/// last but one (not-a-knot); with three samples it is their parabola, with two a line.
pub fn segments(hold: Hold, samples: &[f64], period: f64) -> Vec<Segment> {
    let pairs = samples.windows(2);
    match hold {
        Hold::Zero => pairs.map(|p| Segment::held(p[0])).collect(),
        Hold::Linear => pairs.map(|p| Segment::line(p[0], p[1], period)).collect(),
        Hold::Cubic => {
            let slopes = knot_slopes(samples, period);
            pairs
                .zip(slopes.windows(2))
                .map(|(p, s)| {
                    let chord = (p[1] - p[0]) / period;
                    let c2 = (3.0 * chord - 2.0 * s[0] - s[1]) / period;
                    let c3 = (s[0] + s[1] - 2.0 * chord) / (period * period);
                    Segment { c: [p[0], s[0], c2, c3] }
                })
                .collect()
        }
    }
}

/// Slope of the not-a-knot spline at each sample.
fn knot_slopes(y: &[f64], period: f64) -> Vec<f64> {
    let n = y.len();
    let chord = |i: usize| (y[i + 1] - y[i]) / period;
    match n {
        0 | 1 => return vec![0.0; n],
        2 => return vec![chord(0); 2],
        3 => {
            let (a, b) = (chord(0), chord(1));
            return vec![1.5 * a - 0.5 * b, 0.5 * (a + b), 1.5 * b - 0.5 * a];
        }
        _ => {}
    }
    // Inside: s[i-1] + 4 s[i] + s[i+1] = 3 (chord[i-1] + chord[i]). At the ends not-a-knot: s0 + 2 s1 = (5 chord0 + chord1)/2.
    let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
    upper[0] = 2.0;
    right[0] = 0.5 * (5.0 * chord(0) + chord(1));
    for i in 1..n {
        let (lower, diagonal, above, value) = if i + 1 < n {
            (1.0, 4.0, 1.0, 3.0 * (chord(i - 1) + chord(i)))
        } else {
            (2.0, 1.0, 0.0, 0.5 * (5.0 * chord(n - 2) + chord(n - 3)))
        };
        let pivot = diagonal - lower * upper[i - 1];
        upper[i] = above / pivot;
        right[i] = (value - lower * right[i - 1]) / pivot;
    }
    for i in (0..n - 1).rev() {
        right[i] -= upper[i] * right[i + 1];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_reproduced() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 3.0 * t * t - 0.5 * t * t * t;
        for n in [4, 5, 9] {
            let samples: Vec<f64> = (0..n).map(|i| cubic(0.3 * f64::from(i))).collect();
            for (i, s) in segments(Hold::Cubic, &samples, 0.3).iter().enumerate() {
                assert!((s.value(0.1) - cubic(0.3 * i as f64 + 0.1)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn few_samples_give_a_parabola_or_a_line() {
        let three = segments(Hold::Cubic, &[0.0, 1.0, 4.0], 1.0);
        assert!((three[0].value(0.5) - 0.25).abs() < 1e-15 && (three[1].value(0.5) - 2.25).abs() < 1e-15);
        assert!((segments(Hold::Cubic, &[1.0, 3.0], 2.0)[0].value(1.0) - 2.0).abs() < 1e-15);
        assert!(segments(Hold::Cubic, &[1.0], 1.0).is_empty());
    }
}
