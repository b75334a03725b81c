//! How a signal runs between its samples.

use crate::model::Hold;

/// Cubic in each interval between samples, `c[0] + c[1] s + c[2] s² + c[3] s³` with `s` in s from its start.
///
/// `t` rises and is as long as `y`; there is one interval less than samples. A cubic hold of 2 samples is a
/// line and of 3 a parabola, as the not-a-knot condition implies.
pub fn segments(hold: Hold, t: &[f64], y: &[f64]) -> Vec<[f64; 4]> {
    let n = t.len().min(y.len());
    if n < 2 {
        return Vec::new();
    }
    match hold {
        Hold::Zero => (0..n - 1).map(|i| [y[i], 0.0, 0.0, 0.0]).collect(),
        Hold::Linear => (0..n - 1).map(|i| [y[i], (y[i + 1] - y[i]) / (t[i + 1] - t[i]), 0.0, 0.0]).collect(),
        Hold::Cubic => cubic(&t[..n], &y[..n]),
    }
}

/// Not-a-knot spline: the third derivative does not jump at the second and the last but one sample.
fn cubic(t: &[f64], y: &[f64]) -> Vec<[f64; 4]> {
    let n = t.len();
    let dx: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    let slope: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / dx[i]).collect();
    let derivative = match n {
        2 => vec![slope[0]; 2],
        3 => {
            let curve = (slope[1] - slope[0]) / (t[2] - t[0]);
            vec![slope[0] - curve * dx[0], slope[0] + curve * dx[0], slope[1] + curve * dx[1]]
        }
        _ => not_a_knot(t, &dx, &slope),
    };
    (0..n - 1)
        .map(|i| {
            let third = (derivative[i] + derivative[i + 1] - 2.0 * slope[i]) / dx[i];
            [y[i], derivative[i], (slope[i] - derivative[i]) / dx[i] - third, third / dx[i]]
        })
        .collect()
}

/// Derivatives at the samples, from a tridiagonal system: continuous curvature inside, not-a-knot at both ends.
fn not_a_knot(t: &[f64], dx: &[f64], slope: &[f64]) -> Vec<f64> {
    let n = t.len();
    let (mut below, mut middle, mut above, mut right) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let d = t[2] - t[0];
    (middle[0], above[0]) = (dx[1], d);
    right[0] = ((dx[0] + 2.0 * d) * dx[1] * slope[0] + dx[0] * dx[0] * slope[1]) / d;
    for i in 1..n - 1 {
        (below[i], middle[i], above[i]) = (dx[i], 2.0 * (dx[i - 1] + dx[i]), dx[i - 1]);
        right[i] = 3.0 * (dx[i] * slope[i - 1] + dx[i - 1] * slope[i]);
    }
    let d = t[n - 1] - t[n - 3];
    (below[n - 1], middle[n - 1]) = (d, dx[n - 3]);
    right[n - 1] = (dx[n - 2] * dx[n - 2] * slope[n - 3] + (2.0 * d + dx[n - 2]) * dx[n - 3] * slope[n - 2]) / d;
    for i in 1..n {
        let factor = below[i] / middle[i - 1];
        middle[i] -= factor * above[i - 1];
        right[i] -= factor * right[i - 1];
    }
    let mut x = vec![0.0; n];
    x[n - 1] = right[n - 1] / middle[n - 1];
    for i in (0..n - 1).rev() {
        x[i] = (right[i] - above[i] * x[i + 1]) / middle[i];
    }
    x
}

/// Values at the times of `grid` (rising) of samples `y` at `t` (rising); beyond the ends the end values are kept.
pub fn resample(hold: Hold, t: &[f64], y: &[f64], grid: &[f64]) -> Vec<f64> {
    let pieces = segments(hold, t, y);
    let n = t.len().min(y.len());
    let (Some(first), Some(last)) = (y.first(), y[..n].last()) else { return vec![0.0; grid.len()] };
    let mut i = 0;
    grid.iter()
        .map(|time| {
            if n < 2 || *time <= t[0] {
                return *first;
            }
            if *time >= t[n - 1] {
                return *last;
            }
            // A time that rounding put just before a sample is that sample's: a zero hold would else give the one before.
            while i + 2 < n && t[i + 1] - 1e-6 * (t[i + 1] - t[i]) <= *time {
                i += 1;
            }
            let (s, c) = (time - t[i], &pieces[i]);
            c[0] + s * (c[1] + s * (c[2] + s * c[3]))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_hold_returns_a_cubic() {
        let t: [f64; 6] = [0.0, 0.7, 1.1, 2.0, 2.2, 3.5];
        let f = |x: f64| 1.0 - 2.0 * x + 0.5 * x * x + 0.3 * x * x * x;
        let y: Vec<f64> = t.iter().map(|x| f(*x)).collect();
        let grid: Vec<f64> = (0..35).map(|i| f64::from(i) * 0.1).collect();
        for (x, found) in grid.iter().zip(resample(Hold::Cubic, &t, &y, &grid)) {
            assert!((found - f(*x)).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn short_cubics_are_lines_and_parabolas() {
        assert_eq!(resample(Hold::Cubic, &[0.0, 1.0], &[0.0, 2.0], &[0.5]), [1.0]);
        let found = resample(Hold::Cubic, &[0.0, 1.0, 3.0], &[0.0, 1.0, 9.0], &[0.5, 2.0]);
        assert!((found[0] - 0.25).abs() < 1e-14 && (found[1] - 4.0).abs() < 1e-14, "{found:?}");
    }

    #[test]
    fn zero_and_linear_keep_the_ends() {
        let (t, y, grid) = ([1.0, 2.0, 4.0], [1.0, 3.0, 7.0], [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0]);
        assert_eq!(resample(Hold::Zero, &t, &y, &grid), [1.0, 1.0, 1.0, 3.0, 3.0, 7.0, 7.0]);
        assert_eq!(resample(Hold::Linear, &t, &y, &grid), [1.0, 1.0, 2.0, 3.0, 5.0, 7.0, 7.0]);
        assert_eq!(resample(Hold::Linear, &[], &[], &[1.0]), [0.0]);
    }
}
