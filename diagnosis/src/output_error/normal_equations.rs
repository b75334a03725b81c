//! The normal equations of a fit, where many parameters move one recording only.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Rows that are multiplied at a time: what some hundred columns hold there fits a core's cache.
const ROWS: usize = 256;
/// Pieces of the rows that are summed by themselves, on as many cores as there are: always so many, so that the sums are the same on every machine.
const PIECES: usize = 8;

/// `J' W J` and `J' W r`, J given by its columns. `weights`: one for each residual, or all 1.
pub(crate) fn normal_equations(jacobian: &[Vec<f64>], residuals: &[f64], weights: Option<&[f64]>) -> (DMatrix<f64>, DVector<f64>) {
    let n = jacobian.len();
    // What moves one record only is 0 in all others.
    let spans: Vec<Range<usize>> = jacobian.iter().map(|column| span(column)).collect();
    let size = residuals.len().div_ceil(PIECES).max(1);
    let pieces: Vec<Range<usize>> = (0..PIECES).map(|i| (i * size).min(residuals.len())..((i + 1) * size).min(residuals.len())).collect();
    let part = |piece: Range<usize>| {
        let (mut matrix, mut slope) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for from in piece.clone().step_by(ROWS) {
            let block = from..(from + ROWS).min(piece.end);
            let moved: Vec<usize> = (0..n).filter(|i| spans[*i].start < block.end && block.start < spans[*i].end).collect();
            let values = moved.iter().flat_map(|i| &jacobian[*i][block.clone()]).copied();
            let columns = DMatrix::from_iterator(block.len(), moved.len(), values);
            let mut rows = columns.transpose();
            if let Some(weights) = weights {
                rows.column_iter_mut().zip(&weights[block.clone()]).for_each(|(mut row, weight)| row *= *weight);
            }
            let product = &rows * &columns;
            let right = &rows * DVector::from_column_slice(&residuals[block]);
            for (b, j) in moved.iter().enumerate() {
                slope[*j] += right[b];
                for (a, i) in moved.iter().enumerate() {
                    matrix[(*i, *j)] += product[(a, b)];
                }
            }
        }
        (matrix, slope)
    };
    let parts: Vec<(DMatrix<f64>, DVector<f64>)> = pieces.into_par_iter().map(part).collect();
    parts.into_iter().fold((DMatrix::zeros(n, n), DVector::zeros(n)), |(m, s), (matrix, slope)| (m + matrix, s + slope))
}

/// From the first to behind the last value that is not 0.
fn span(column: &[f64]) -> Range<usize> {
    let is_something = |x: &f64| *x != 0.0;
    match (column.iter().position(is_something), column.iter().rposition(is_something)) {
        (Some(from), Some(last)) => from..last + 1,
        _ => 0..0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_whole_columns() {
        // Some columns everywhere, some on a stretch only, one nowhere.
        let rows = 5003;
        let stretch = |k: usize| match k {
            0..4 => 0..rows,
            4..20 => 300 * k - 1000..300 * k,
            _ => 0..0,
        };
        let value = |k: usize, i: usize| ((k + 1) as f64 * i as f64 * 0.01).sin();
        let jacobian: Vec<Vec<f64>> =
            (0..21).map(|k| (0..rows).map(|i| if stretch(k).contains(&i) { value(k, i) } else { 0.0 }).collect()).collect();
        let residuals: Vec<f64> = (0..rows).map(|i| (0.3 * i as f64).cos()).collect();
        let weights: Vec<f64> = (0..rows).map(|i| 1.0 / (1.0 + i as f64)).collect();
        for weights in [None, Some(weights.as_slice())] {
            let (matrix, slope) = normal_equations(&jacobian, &residuals, weights);
            let weight = |i: usize| weights.map_or(1.0, |w| w[i]);
            let sum = |a: &[f64], b: &[f64]| -> f64 { (0..rows).map(|i| weight(i) * a[i] * b[i]).sum() };
            for i in 0..jacobian.len() {
                assert!((slope[i] - sum(&jacobian[i], &residuals)).abs() < 1e-9, "{i}");
                for j in 0..jacobian.len() {
                    assert!((matrix[(i, j)] - sum(&jacobian[i], &jacobian[j])).abs() < 1e-9, "{i} {j}");
                }
            }
        }
    }

    #[test]
    fn nothing_to_fit_and_nothing_to_fit_to_are_fine() {
        assert_eq!(normal_equations(&[], &[1.0, 2.0], None).0.shape(), (0, 0));
        assert_eq!(normal_equations(&[vec![]], &[], None).0[(0, 0)], 0.0);
    }
}
