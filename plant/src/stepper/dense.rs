//! Small dense matrices.

use super::slots::{Columns, SLOTS};
use nalgebra::DMatrix;

/// Cholesky factor of a symmetric matrix.
///
/// # Errors
/// The index of the first row whose pivot is not above `1e-13` of the row's diagonal.
pub(super) fn cholesky(a: &DMatrix<f64>) -> Result<DMatrix<f64>, usize> {
    let n = a.nrows();
    let mut l = DMatrix::zeros(n, n);
    for j in 0..n {
        let pivot = a[(j, j)] - (0..j).map(|k| l[(j, k)] * l[(j, k)]).sum::<f64>();
        if !(pivot.is_finite() && pivot > 1e-13 * a[(j, j)].abs() && pivot > 0.0) {
            return Err(j);
        }
        let root: f64 = f64::sqrt(pivot);
        l[(j, j)] = root;
        for i in j + 1..n {
            l[(i, j)] = (a[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>()) / root;
        }
    }
    Ok(l)
}

/// Solves `L y = b` in place, column by column.
pub(super) fn forward(l: &DMatrix<f64>, b: &mut DMatrix<f64>) {
    let n = l.nrows();
    for c in 0..b.ncols() {
        for i in 0..n {
            let s: f64 = (0..i).map(|k| l[(i, k)] * b[(k, c)]).sum();
            b[(i, c)] = (b[(i, c)] - s) / l[(i, i)];
        }
    }
}

/// Inverse of a square matrix, or `None` when it is singular.
pub(super) fn inverse(a: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if a.nrows() == 0 { Some(a.clone()) } else { a.clone().try_inverse() }
}

/// Largest absolute eigenvalue of `M⁻¹ K` for symmetric K, M = L Lᵀ.
pub(super) fn largest_ratio(l: &DMatrix<f64>, k: &DMatrix<f64>) -> f64 {
    if l.nrows() == 0 {
        return 0.0;
    }
    let mut half = k.clone();
    forward(l, &mut half);
    let mut whole = half.transpose();
    forward(l, &mut whole);
    let symmetric = (&whole + whole.transpose()) * 0.5;
    symmetric.symmetric_eigenvalues().iter().fold(0.0, |largest: f64, e| largest.max(e.abs()))
}

/// Inverse of the leading `n` rows and columns of a matrix, `n` of [`SLOTS`] at most, in place of it (Gauss and Jordan, with the greatest pivot of each column). Nothing is allocated.
/// `false` when it is singular; what is there then is no inverse.
pub(super) fn invert(a: &mut Columns, n: usize) -> bool {
    let mut rows = [0usize; SLOTS];
    for j in 0..n {
        let pivot = (j..n).fold(j, |best, i| if a[i][j].abs() > a[best][j].abs() { i } else { best });
        if a[pivot][j] == 0.0 || !a[pivot][j].is_finite() {
            return false;
        }
        a.swap(j, pivot);
        rows[j] = pivot;
        let by = 1.0 / a[j][j];
        a[j][j] = 1.0;
        a[j][..n].iter_mut().for_each(|value| *value *= by);
        for i in (0..n).filter(|i| *i != j) {
            let (other, row) = a.with(i, j);
            let factor = std::mem::take(&mut other[j]);
            for (value, own) in other[..n].iter_mut().zip(&row[..n]) {
                *value -= factor * own;
            }
        }
    }
    for j in (0..n).rev().filter(|j| rows[*j] != *j) {
        for i in 0..n {
            a[i].swap(j, rows[j]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        for n in [1, 2, 5, SLOTS] {
            let mut a = Columns::new(n);
            for i in 0..n {
                for j in 0..n {
                    // The first pivot is 0, so that rows are exchanged.
                    a[i][j] = ((3 * i + 7 * j) as f64 * 1.7).sin() + if i + 1 == n - j { 2.0 } else { 0.0 };
                }
            }
            let first = a.clone();
            assert!(invert(&mut a, n));
            for i in 0..n {
                for j in 0..n {
                    let product: f64 = (0..n).map(|k| first[i][k] * a[k][j]).sum();
                    assert!((product - f64::from(u8::from(i == j))).abs() < 1e-10, "{n} {i} {j} {product}");
                }
            }
        }
        assert!(!invert(&mut Columns::new(3), 3));
    }
}
