//! One period of a linear model, by its propagator.

use super::propagator::{MAX_ROWS, Propagator};
use super::state::Plant;

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
