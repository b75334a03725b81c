//! Small dense matrices at compile time.

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
