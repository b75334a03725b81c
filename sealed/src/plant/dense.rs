//! Small dense symmetric matrices.

/// The inverse of a symmetric positive definite matrix of `n` rows, row by row in one list; `None` where it is not positive definite.
pub(super) fn inverse(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    // Cholesky, matrix = L L', then the columns of the inverse by forward and backward substitution.
    let mut lower = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| lower[i * n + k] * lower[j * n + k]).sum();
            let rest = matrix[i * n + j] - sum;
            if i == j {
                // A pivot this far below its row has lost every digit.
                if rest.is_nan() || rest <= 1e-14 * matrix[i * n + i].abs() {
                    return None;
                }
                lower[i * n + i] = rest.sqrt();
            } else {
                lower[i * n + j] = rest / lower[j * n + j];
            }
        }
    }
    let mut inverse = vec![0.0; n * n];
    let mut column = vec![0.0; n];
    for c in 0..n {
        for i in 0..n {
            let sum: f64 = (0..i).map(|k| lower[i * n + k] * column[k]).sum();
            column[i] = (f64::from(u8::from(i == c)) - sum) / lower[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| lower[k * n + i] * column[k]).sum();
            column[i] = (column[i] - sum) / lower[i * n + i];
        }
        for i in 0..n {
            inverse[i * n + c] = column[i];
        }
    }
    Some(inverse)
}

/// Adds a coefficient between two places to a symmetric matrix of `n` rows.
pub(super) fn add_between(matrix: &mut [f64], n: usize, between: [Option<usize>; 2], value: f64) {
    for (a, sign_a) in [(between[0], 1.0), (between[1], -1.0)] {
        for (b, sign_b) in [(between[0], 1.0), (between[1], -1.0)] {
            if let (Some(a), Some(b)) = (a, b) {
                matrix[a * n + b] += sign_a * sign_b * value;
            }
        }
    }
}

/// The rows and columns of some bodies of a matrix of `n` rows.
pub(super) fn pick(matrix: &[f64], n: usize, bodies: &[usize]) -> Vec<f64> {
    bodies.iter().flat_map(|i| bodies.iter().map(move |j| matrix[i * n + j])).collect()
}

#[cfg(test)]
mod tests {
    use super::inverse;

    #[test]
    fn times_the_matrix_is_one() {
        let matrix = [4.0, 1.0, -0.5, 1.0, 3.0, 0.2, -0.5, 0.2, 2.0];
        let inverse = inverse(&matrix, 3).unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| matrix[i * 3 + k] * inverse[k * 3 + j]).sum();
                assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn singular_is_told() {
        assert!(inverse(&[1.0, 1.0, 1.0, 1.0], 2).is_none());
        assert!(inverse(&[0.0], 1).is_none());
    }
}
