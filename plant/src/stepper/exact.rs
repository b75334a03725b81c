//! Linear models: exact propagation from sample to sample.
//!
//! With the state s = (x, v, lags) and inputs that are polynomials over the substep, `s' = A s + B u(t) + g` has the
//! solution of an augmented system whose generator is constant; one matrix exponential gives it for every substep.

use super::Plant;
use super::compile::Compiled;
use super::drive::Drive;
use nalgebra::DMatrix;

/// Rows at most: positions, velocities, lags.
const MAX_ROWS: usize = 48;

/// Solution over one substep.
#[derive(Debug, Clone)]
pub(super) struct Propagator {
    /// Rows that are used, and rows that are stored.
    rows: usize,
    stored_rows: usize,
    /// Column by column: state, then for each force input its value at the middle and slope, for each motion input its
    /// value and three derivatives at the start, then 1.
    columns: Vec<f64>,
    /// Index of the lag of each input among the rows.
    lags: Vec<Option<usize>>,
    /// Jump of free velocities per jump of a prescribed one: empty when no inertance joins them.
    jumps: Vec<(usize, usize, f64)>,
}

impl Propagator {
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

impl Plant {
    /// One period of a linear model.
    pub(super) fn step_exactly(&mut self) {
        let Some(propagator) = self.exact.take() else { return };
        match propagator.stored_rows {
            2 => self.propagate::<2>(&propagator),
            4 => self.propagate::<4>(&propagator),
            6 => self.propagate::<6>(&propagator),
            8 => self.propagate::<8>(&propagator),
            12 => self.propagate::<12>(&propagator),
            16 => self.propagate::<16>(&propagator),
            24 => self.propagate::<24>(&propagator),
            _ => self.propagate::<MAX_ROWS>(&propagator),
        }
        self.exact = Some(propagator);
    }

    fn propagate<const R: usize>(&mut self, propagator: &Propagator) {
        let n = self.fixed.free;
        for index in 0..self.substeps {
            let from = self.substep * index as f64;
            let to = if index + 1 == self.substeps { self.period } else { self.substep * (index + 1) as f64 };
            for (slot, i, jump) in &propagator.jumps {
                if let Some(drive) = self.drives.iter().find(|drive| drive.slot == *slot && drive.moves) {
                    self.v[*i] += jump * (drive.motion(from).1 - self.v[*slot]);
                }
            }
            let mut next = [0.0; R];
            let mut columns = propagator.columns.chunks_exact(R);
            let mut add = |q: f64| {
                if let Some(column) = columns.next() {
                    for i in 0..R {
                        next[i] += column[i] * q;
                    }
                }
            };
            for i in 0..n {
                add(self.x[i]);
            }
            for i in 0..n {
                add(self.v[i]);
            }
            for (drive, lag) in self.drives.iter().zip(&propagator.lags) {
                if lag.is_some() {
                    add(drive.lagged);
                }
            }
            for drive in &self.drives {
                if drive.moves {
                    let (x0, v0, _) = drive.motion(from);
                    let (x1, v1, a1) = drive.motion(to);
                    let h = self.substep;
                    let chord = (x1 - x0) / h;
                    add(x0);
                    add(v0);
                    add(2.0 * (3.0 * chord - 2.0 * v0 - v1) / h);
                    add(6.0 * (v0 + v1 - 2.0 * chord) / (h * h));
                    (self.x[drive.slot], self.v[drive.slot], self.prescribed_acceleration[drive.slot]) = (x1, v1, a1);
                } else {
                    let (mean, slope) = drive.line(from, to);
                    add(mean);
                    add(slope);
                }
            }
            add(1.0);
            self.x[..n].copy_from_slice(&next[..n]);
            self.v[..n].copy_from_slice(&next[n..2 * n]);
            for (drive, lag) in self.drives.iter_mut().zip(&propagator.lags) {
                if let Some(row) = lag.filter(|row| *row < propagator.rows) {
                    drive.lagged = next[row];
                }
            }
            if self.sense.watches_substeps() {
                self.note_pushes(to);
                self.note_outputs();
            }
        }
        self.note_pushes(self.period);
    }
}
