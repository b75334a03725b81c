//! Windings of the loops of several axes.

use crate::frequency::eigenvalues;
use nalgebra::{Complex, DMatrix};
use std::f64::consts::{PI, TAU};

/// A matrix over the axes.
pub(super) type Matrix = DMatrix<Complex<f64>>;

/// The loop of one axis, the others open.
pub(super) fn alone(l: &[Matrix], axis: usize) -> Vec<Matrix> {
    l.iter().map(|m| Matrix::from_element(1, 1, m[(axis, axis)])).collect()
}

/// The eigenvalues from line to line, each followed to the one that is nearest: real and imaginary parts by locus.
pub(super) fn tracked(l: &[Matrix]) -> Vec<Vec<[f64; 2]>> {
    let mut out: Vec<Vec<[f64; 2]>> = vec![Vec::with_capacity(l.len()); l.first().map_or(0, Matrix::nrows)];
    for m in l {
        let mut free = eigenvalues(m);
        for locus in &mut out {
            let before = locus.last().copied();
            let away = |e: &Complex<f64>| before.map_or(0.0, |[re, im]| (e - Complex::new(re, im)).norm());
            let Some(nearest) = (0..free.len()).min_by(|a, b| away(&free[*a]).total_cmp(&away(&free[*b]))) else { continue };
            let e = free.swap_remove(nearest);
            locus.push([e.re, e.im]);
        }
    }
    out
}

/// How often the eigenvalues of `k L` encircle +1 clockwise from -∞ to ∞: `-1/2π` times what `det(I - k L)` turns. `l` over lines from about DC to half the
/// rate, so close that it turns by less than half a circle from one to the next; at both ends it is real.
pub(super) fn encirclements(l: &[Matrix], k: f64) -> i64 {
    let one = Complex::new(1.0, 0.0);
    let determinant = |m: &Matrix| eigenvalues(m).into_iter().map(|e| one - e * k).product::<Complex<f64>>();
    let to_real = |z: Complex<f64>| if z.re >= 0.0 { -z.arg() } else { z.arg().signum() * PI - z.arg() };
    let (mut turned, mut before): (f64, Option<Complex<f64>>) = (0.0, None);
    for m in l {
        let now = determinant(m);
        match before {
            // From DC, where it is real, to the lowest line.
            None => turned -= to_real(now),
            Some(before) => turned += (now / before).arg(),
        }
        before = Some(now);
    }
    turned += before.map_or(0.0, to_real);
    // Negative frequencies are the mirror image.
    (-2.0 * turned / TAU).round() as i64
}
