//! Least squares on sums of a few of many columns, by the products of the columns with each other, kept apart for each stretch of the recordings.

use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Products of columns, in stretches.
pub(crate) struct Gram {
    columns: usize,
    total: Vec<f64>,
    /// Samples of each stretch, and its products: first those that fits see.
    stretches: Vec<(usize, Vec<f64>)>,
    /// How many of them fits see.
    seen: usize,
    /// Root mean square of each column: what it was divided by.
    scales: Vec<f64>,
    /// What is known of each column's factor before any fit: the inverse of its variance in units of the residual's, for the column over its root mean square.
    prior: Vec<f64>,
}

/// What is explained, and by what: the sum of some columns, by factors of others.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sum {
    /// Columns that are explained.
    pub target: Vec<usize>,
    /// Columns that explain it.
    pub by: Vec<usize>,
}

/// What a sum leaves of each stretch: columns, each over its root mean square, with their factors.
pub(crate) type Left = Vec<Vec<(usize, f64)>>;

impl Gram {
    /// Of columns that are all as long, in these stretches of them, of which fits see the first `seen`.
    pub fn of(columns: &[Vec<f64>], stretches: &[Range<usize>], seen: usize) -> Gram {
        use rayon::prelude::*;
        let rms = |c: &Vec<f64>| (c.iter().map(|x| x * x).sum::<f64>() / c.len().max(1) as f64).sqrt();
        let scales: Vec<f64> = columns.iter().map(|c| Some(rms(c)).filter(|s| *s > 0.0).unwrap_or(1.0)).collect();
        let n = columns.len();
        let product = |range: &Range<usize>| {
            let part = DMatrix::from_fn(range.len(), n, |row, column| columns[column][range.start + row] / scales[column]);
            (range.len(), (part.transpose() * &part).as_slice().to_vec())
        };
        let stretches: Vec<(usize, Vec<f64>)> = stretches.par_iter().map(product).collect();
        let mut total = vec![0.0; n * n];
        for (_, part) in stretches.iter().take(seen) {
            total.iter_mut().zip(part).for_each(|(t, p)| *t += p);
        }
        Gram { columns: n, total, stretches, seen, scales, prior: vec![0.0; n] }
    }

    /// States that the factor of a column is 0 within a standard deviation, where residuals have this variance (that of their mean over a correlation time,
    /// times the samples in it).
    pub fn expect_near_zero(&mut self, column: usize, sd: f64, variance: f64) {
        if let (Some(prior), Some(scale)) = (self.prior.get_mut(column), self.scales.get(column)) {
            *prior = variance / (sd * scale).powi(2);
        }
    }

    fn at(&self, products: &[f64], a: usize, b: usize) -> f64 {
        products[a * self.columns + b]
    }

    /// Products of what explains, with what is explained, and of that with itself; each column in its own unit of root mean square, what is explained in its unit.
    fn parts(&self, products: &[f64], sum: &Sum) -> (DMatrix<f64>, DVector<f64>, f64) {
        let scale = |c: usize| self.scales[c];
        let matrix = DMatrix::from_fn(sum.by.len(), sum.by.len(), |i, j| self.at(products, sum.by[i], sum.by[j]));
        let with = |by: usize| sum.target.iter().map(|t| scale(*t) * self.at(products, by, *t)).sum::<f64>();
        let vector = DVector::from_iterator(sum.by.len(), sum.by.iter().map(|by| with(*by)));
        let own = sum.target.iter().flat_map(|a| sum.target.iter().map(move |b| scale(*a) * scale(*b) * self.at(products, *a, *b))).sum();
        (matrix, vector, own)
    }

    /// Least-squares factors of the columns; `None` if the matrix is singular.
    fn solve(&self, matrix: &DMatrix<f64>, vector: &DVector<f64>, sum: &Sum) -> Option<DVector<f64>> {
        let n = vector.len();
        if n == 0 {
            return Some(vector.clone());
        }
        let ridge = 1e-10 * matrix.diagonal().max();
        let mut regular = matrix.clone();
        sum.by.iter().enumerate().for_each(|(i, column)| regular[(i, i)] += ridge + self.prior[*column]);
        Some(regular.cholesky()?.solve(vector)).filter(|p| p.iter().all(|x| x.is_finite()))
    }

    /// Factors of the columns that explain, each in its own unit, and the mean square of what is left.
    pub fn fit(&self, sum: &Sum) -> Option<(Vec<f64>, f64)> {
        let (matrix, vector, own) = self.parts(&self.total, sum);
        let factors = self.solve(&matrix, &vector, sum)?;
        let samples: usize = self.stretches.iter().take(self.seen).map(|(samples, _)| samples).sum();
        let left = (own - 2.0 * factors.dot(&vector) + factors.dot(&(&matrix * &factors))).max(0.0) / samples.max(1) as f64;
        Some((sum.by.iter().zip(factors.iter()).map(|(c, x)| x / self.scales[*c]).collect(), left))
    }

    /// Groups of columns by how much each takes of what a sum leaves, the one that takes most first.
    pub fn ranked(&self, sum: &Sum, groups: &[Vec<usize>]) -> Vec<usize> {
        let (mut matrix, vector, _) = self.parts(&self.total, sum);
        let ridge = 1e-10 * matrix.diagonal().iter().fold(0.0f64, |a, b| a.max(*b));
        sum.by.iter().enumerate().for_each(|(i, column)| matrix[(i, i)] += ridge + self.prior[*column]);
        let Some(factor) = matrix.cholesky() else { return (0..groups.len()).collect() };
        let lower = factor.l_dirty();
        let Some(known) = lower.solve_lower_triangular(&vector) else { return (0..groups.len()).collect() };
        let takes = |group: &Vec<usize>| -> f64 {
            let m = group.len();
            let cross = DMatrix::from_fn(sum.by.len(), m, |i, j| self.at(&self.total, sum.by[i], group[j]));
            let Some(seen) = lower.solve_lower_triangular(&cross) else { return 0.0 };
            let own = DMatrix::from_fn(m, m, |i, j| self.at(&self.total, group[i], group[j])) - seen.tr_mul(&seen);
            let with = |c: usize| sum.target.iter().map(|t| self.scales[*t] * self.at(&self.total, c, *t)).sum::<f64>();
            let rest = DVector::from_fn(m, |i, _| with(group[i])) - seen.tr_mul(&known);
            let regular = &own + DMatrix::identity(m, m) * (1e-10 * own.diagonal().iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b)));
            regular.cholesky().map_or(0.0, |c| rest.dot(&c.solve(&rest)))
        };
        let gains: Vec<f64> = groups.iter().map(takes).collect();
        let mut order: Vec<usize> = (0..groups.len()).collect();
        order.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
        order
    }

    /// What is left of each stretch by factors that were found on all others that fits see.
    pub fn left(&self, sum: &Sum) -> Option<Left> {
        let (matrix, vector, _) = self.parts(&self.total, sum);
        let of_all = self.solve(&matrix, &vector, sum)?;
        let one = |(index, (_, products)): (usize, &(usize, Vec<f64>))| {
            let (own_matrix, own_vector, _) = self.parts(products, sum);
            let factors = match index < self.seen {
                true => self.solve(&(&matrix - &own_matrix), &(&vector - &own_vector), sum)?,
                false => of_all.clone(),
            };
            let target = sum.target.iter().map(|t| (*t, self.scales[*t]));
            Some(target.chain(sum.by.iter().zip(factors.iter()).map(|(by, factor)| (*by, -factor))).collect())
        };
        self.stretches.iter().enumerate().map(one).collect()
    }

    /// Mean product of what two sums leave, stretch by stretch.
    pub fn mean_product(&self, a: &Left, b: &Left) -> Vec<f64> {
        let one = |(index, (samples, products)): (usize, &(usize, Vec<f64>))| {
            let (a, b) = (a.get(index).map_or(&[][..], Vec::as_slice), b.get(index).map_or(&[][..], Vec::as_slice));
            let with = |(column, factor): &(usize, f64)| factor * b.iter().map(|(c, f)| f * self.at(products, *column, *c)).sum::<f64>();
            a.iter().map(with).sum::<f64>() / (*samples).max(1) as f64
        };
        self.stretches.iter().enumerate().map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_out_stretches_are_those_of_a_fit_of_the_others() {
        let n = 120;
        let a: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
        let b: Vec<f64> = (0..n).map(|i| 1e-3 * (0.11 * i as f64).cos()).collect();
        let y: Vec<f64> = (0..n).map(|i| 2.0 * a[i] - 500.0 * b[i] + 0.1 * (1.7 * i as f64).sin()).collect();
        let stretches = [0..40, 40..80, 80..120];
        let gram = Gram::of(&[y.clone(), a.clone(), b.clone()], &stretches, 3);
        let sum = Sum { target: vec![0], by: vec![1, 2] };
        let (factors, left) = gram.fit(&sum).unwrap();
        assert!((factors[0] - 2.0).abs() < 0.05 && (factors[1] + 500.0).abs() < 30.0, "{factors:?}");
        assert!((left - 0.005).abs() < 0.001, "{left}");
        let bare = Sum { target: vec![0], by: Vec::new() };
        assert_eq!(gram.ranked(&bare, &[vec![2], vec![1], vec![1, 2]]), [2, 1, 0]);
        let left = gram.left(&sum).unwrap();
        let errors = gram.mean_product(&left, &left);
        for (stretch, error) in stretches.iter().zip(errors) {
            let rows: Vec<usize> = (0..n).filter(|i| !stretch.contains(i)).collect();
            let matrix = DMatrix::from_fn(rows.len(), 2, |r, c| if c == 0 { a[rows[r]] } else { b[rows[r]] });
            let target = DVector::from_iterator(rows.len(), rows.iter().map(|i| y[*i]));
            let p = matrix.svd(true, true).solve(&target, 1e-14).unwrap();
            let direct = stretch.clone().map(|i| (y[i] - p[0] * a[i] - p[1] * b[i]).powi(2)).sum::<f64>() / 40.0;
            assert!((direct - error).abs() < 1e-6 * direct, "{direct} {error}");
        }
    }
}
