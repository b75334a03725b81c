//! The Riccati equation of the observer's gains, solved by the sign of its Hamiltonian matrix.

use nalgebra::{DMatrix, DVector};

/// Most steps of the sign iteration; it needs about ten.
const MOST_STEPS: usize = 100;

/// The stabilising solution X = X' of `F X + X F' + Q - X W X = 0`, Q and W symmetric; `None` where there is none.
///
/// The sign function of the Hamiltonian matrix [[F', -W], [-Q, -F]] (Roberts 1980) gives its stable subspace. It is computed by Newton's iteration
/// scaled with the determinant (Byers 1987). A step of Newton's method on the equation itself then removes the rounding error.
pub fn solve(f: &DMatrix<f64>, q: &DMatrix<f64>, w: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = f.nrows();
    let mut h = DMatrix::zeros(2 * n, 2 * n);
    h.view_mut((0, 0), (n, n)).copy_from(&f.transpose());
    h.view_mut((0, n), (n, n)).copy_from(&-w);
    h.view_mut((n, 0), (n, n)).copy_from(&-q);
    h.view_mut((n, n), (n, n)).copy_from(&-f);
    let sign = sign(h)?;
    // (sign + 1) [I; X] = 0.
    let one = DMatrix::<f64>::identity(n, n);
    let (mut left, mut right) = (DMatrix::zeros(2 * n, n), DMatrix::zeros(2 * n, n));
    left.rows_mut(0, n).copy_from(&sign.view((0, n), (n, n)));
    left.rows_mut(n, n).copy_from(&(sign.view((n, n), (n, n)) + &one));
    right.rows_mut(0, n).copy_from(&-(sign.view((0, 0), (n, n)) + &one));
    right.rows_mut(n, n).copy_from(&-sign.view((n, 0), (n, n)));
    let qr = left.qr();
    let x = qr.r().solve_upper_triangular(&(qr.q().transpose() * right))?;
    let mut x = symmetric(x);
    for _ in 0..2 {
        let closed = f - &x * w;
        let change = lyapunov(&closed, &residual(f, q, w, &x))?;
        let better = symmetric(&x + change);
        if residual(f, q, w, &better).norm() >= residual(f, q, w, &x).norm() {
            break;
        }
        x = better;
    }
    let scale = q.norm() + (f * &x).norm() + (&x * w * &x).norm();
    let solved = residual(f, q, w, &x).norm() <= 1e-8 * scale;
    let stable = is_stable(&(f - &x * w));
    (solved && stable && x.iter().all(|v| v.is_finite())).then_some(x)
}

/// Whether every eigenvalue has a negative real part.
pub fn is_stable(matrix: &DMatrix<f64>) -> bool {
    matrix.complex_eigenvalues().iter().all(|s| s.re < 0.0)
}

/// `F X + X F' + Q - X W X`.
pub fn residual(f: &DMatrix<f64>, q: &DMatrix<f64>, w: &DMatrix<f64>, x: &DMatrix<f64>) -> DMatrix<f64> {
    let half = f * x;
    &half + half.transpose() + q - x * w * x
}

fn symmetric(x: DMatrix<f64>) -> DMatrix<f64> {
    (&x + x.transpose()) * 0.5
}

fn sign(mut z: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = z.nrows() as f64;
    for _ in 0..MOST_STEPS {
        let lu = z.clone().lu();
        // The determinant itself would leave the range of numbers.
        let log: f64 = lu.u().diagonal().iter().map(|d| d.abs().ln()).sum();
        let scale = (-log / size).exp();
        if !scale.is_finite() || scale == 0.0 {
            return None;
        }
        let next = (&z * scale + lu.try_inverse()? / scale) * 0.5;
        let change = (&next - &z).norm() / next.norm();
        if !change.is_finite() {
            return None;
        }
        z = next;
        if change < 1e-13 {
            return Some(z);
        }
    }
    // At the limit of existence eigenvalues lie on the imaginary axis, where the sign is not defined.
    ((&z * &z - DMatrix::identity(z.nrows(), z.nrows())).norm() < 1e-6).then_some(z)
}

/// X of `A X + X A' + Q = 0`; `None` where it is not unique.
pub fn lyapunov(a: &DMatrix<f64>, q: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let one = DMatrix::identity(n, n);
    let both = one.kronecker(a) + a.kronecker(&one);
    let x = both.lu().solve(&DVector::from_column_slice((-q).as_slice()))?;
    Some(DMatrix::from_column_slice(n, n, x.as_slice()))
}
