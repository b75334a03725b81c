//! Linear models: exact propagation from sample to sample.
//!
//! With the state s = (x, v, lags) and inputs that are polynomials over the substep, `s' = A s + B u(t) + g` has the solution of an augmented system.
//! Its generator is constant, and one matrix exponential gives the solution for every substep.

use super::compiled::Compiled;
use super::drive::Drive;
use crate::model::{Input, InputKind};
use nalgebra::DMatrix;

/// Rows at most: positions, velocities, lags.
pub(super) const MAX_ROWS: usize = 48;

/// Solution over one substep.
#[derive(Debug, Clone)]
pub(super) struct Propagator {
    /// Rows that are used, and rows that are stored.
    pub(super) rows: usize,
    pub(super) stored_rows: usize,
    /// Column by column: state, then for each force input its value at the middle and slope, for each motion input its
    /// value and three derivatives at the start, then 1.
    pub(super) columns: Vec<f64>,
    /// Index of the lag of each input among the rows.
    pub(super) lags: Vec<Option<usize>>,
    /// Jump of free velocities per jump of a prescribed one: empty when no inertance joins them.
    pub(super) jumps: Vec<(usize, usize, f64)>,
}

impl Propagator {
    /// Whether a network of this number of free bodies is small enough.
    pub(super) fn holds(free: usize, inputs: &[Input]) -> bool {
        let lags = inputs.iter().filter(|input| input.kind == InputKind::Force && input.bandwidth.is_finite()).count();
        2 * free + lags <= MAX_ROWS
    }

    /// `None` when the model is larger than this holds or its exponential is not finite.
    pub(super) fn new(fixed: &Compiled, drives: &[Drive], substep: f64) -> Option<Propagator> {
        let n = fixed.free;
        let mut rows = 2 * n;
        let lags: Vec<Option<usize>> = drives
            .iter()
            .map(|drive| {
                drive.lag_rate().map(|_| {
                    rows += 1;
                    rows - 1
                })
            })
            .collect();
        if rows > MAX_ROWS || rows == 0 {
            return None;
        }
        let inputs: usize = drives.iter().map(|drive| if drive.moves { 4 } else { 2 }).sum();
        let size = rows + inputs + 1;
        let mut generator = DMatrix::zeros(size, size);
        let inverse = |i: usize, j: usize| fixed.inverse_mass[j][i];
        // Acceleration of free body i for a force on each free body.
        let accelerate = |force: &dyn Fn(usize) -> f64, i: usize| (0..n).map(|j| inverse(i, j) * force(j)).sum::<f64>();
        for i in 0..n {
            generator[(i, n + i)] = 1.0;
            for j in 0..n {
                generator[(n + i, j)] = -accelerate(&|k| fixed.stiffness[k][j], i);
                generator[(n + i, n + j)] = -accelerate(&|k| fixed.damping[k][j], i);
            }
            generator[(n + i, size - 1)] = accelerate(&|k| fixed.constant[k], i);
        }
        let mut column = rows;
        let mut jumps = Vec::new();
        for (drive, lag) in drives.iter().zip(&lags) {
            if drive.moves {
                for derivative in 0..3 {
                    generator[(column + derivative, column + derivative + 1)] = 1.0;
                }
                for (derivative, matrix) in [&fixed.stiffness, &fixed.damping, &fixed.mass].into_iter().enumerate() {
                    for i in 0..n {
                        generator[(n + i, column + derivative)] = -accelerate(&|k| matrix[k][drive.slot], i);
                    }
                }
                for i in 0..n {
                    let jump = generator[(n + i, column + 2)];
                    if jump != 0.0 {
                        jumps.push((drive.slot, i, jump));
                    }
                }
                column += 4;
            } else {
                generator[(column, column + 1)] = 1.0;
                let at = match (lag, drive.lag_rate()) {
                    (Some(row), Some(rate)) => {
                        generator[(*row, *row)] = -rate;
                        generator[(*row, column)] = rate;
                        *row
                    }
                    _ => column,
                };
                if drive.slot < n {
                    for i in 0..n {
                        generator[(n + i, at)] += inverse(i, drive.slot);
                    }
                }
                column += 2;
            }
        }
        let mut solution = (generator * substep).exp();
        // A force is given by its mean, which is the value in the middle: shift its start by half a substep.
        column = rows;
        for drive in drives {
            if !drive.moves {
                for i in 0..rows {
                    let by_value = solution[(i, column)];
                    solution[(i, column + 1)] -= 0.5 * substep * by_value;
                }
            }
            column += if drive.moves { 4 } else { 2 };
        }
        let stored_rows = [2, 4, 6, 8, 12, 16, 24, MAX_ROWS].into_iter().find(|r| *r >= rows)?;
        let mut columns = vec![0.0; stored_rows * size];
        for j in 0..size {
            for i in 0..rows {
                columns[j * stored_rows + i] = solution[(i, j)];
            }
        }
        columns.iter().all(|c| c.is_finite()).then_some(Propagator { rows, stored_rows, columns, lags, jumps })
    }
}
