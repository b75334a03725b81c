//! The torque that a structure's parameters can explain: weighted inner products of its columns, and of a torque that it is compared with.

use crate::arms::fit::{Fit, Structure, TOLERANCES, Weights};
use crate::arms::physics::{Physics, Term};
use crate::arms::regression::Data;
use crate::arms::system::scaled_solve;
use nalgebra::{DMatrix, DVector};

/// Weighted inner products over the logs for fitting.
#[derive(Debug, Clone)]
pub struct Gram {
    /// Of the columns.
    matrix: DMatrix<f64>,
    /// Of the columns with the torque.
    cross: DVector<f64>,
    /// Of the torque with itself.
    square: f64,
    /// How surely each number is known before, one over the square of its standard deviation.
    prior: DVector<f64>,
}

impl Gram {
    /// Both together.
    pub fn with(&self, other: &Gram) -> Gram {
        Gram {
            matrix: &self.matrix + &other.matrix,
            cross: &self.cross + &other.cross,
            square: self.square + other.square,
            prior: self.prior.clone(),
        }
    }

    /// The weighted square that the columns cannot explain.
    pub fn left(&self) -> f64 {
        let n = self.cross.len();
        let whole =
            &self.matrix + DMatrix::from_fn(n, n, |i, j| if i == j { self.prior[i] + 1e-9 * self.matrix[(i, i)] + 1e-300 } else { 0.0 });
        let right = DMatrix::from_column_slice(n, 1, self.cross.as_slice());
        scaled_solve(&whole, &right).map_or(0.0, |solved| (self.square - self.cross.dot(&solved.column(0))).max(0.0))
    }
}

impl Data<'_> {
    /// Inner products of a structure's columns and of the torque of some terms with their parameters, with the given weight of the logs.
    pub fn gram(&self, structure: &Structure, terms: &[(Term, Vec<f64>)], weights: &Weights, times: f64) -> Option<Gram> {
        let (columns, _) = self.all_columns(structure);
        let mut torque = vec![0.0; self.layout.rows];
        for (term, values) in terms {
            for (column, value) in self.columns(term, &structure.slip).iter().zip(values) {
                torque.iter_mut().zip(column.iter()).for_each(|(t, c)| *t += value * c);
            }
        }
        let mut rows: Vec<(usize, f64)> = Vec::new();
        for m in 0..self.fit_count {
            for j in 0..self.layout.joints {
                let weight = times.sqrt() / (weights.sd[j] * weights.time[j].sqrt());
                rows.extend(self.layout.of(m, j).map(|row| (row, weight)));
            }
        }
        let weighted = DMatrix::from_fn(rows.len(), columns.len(), |i, j| columns[j][rows[i].0] * rows[i].1);
        let torque = DVector::from_fn(rows.len(), |i, _| torque[rows[i].0] * rows[i].1);
        let known = TOLERANCES.get(structure.tolerance).map_or(1.0, |t| 1.0 / (t * t));
        let prior = DVector::from_fn(columns.len(), |i, _| if i < self.inertial.len() { known } else { 0.0 });
        let gram = Gram { matrix: weighted.tr_mul(&weighted), cross: weighted.tr_mul(&torque), square: torque.norm_squared(), prior };
        (gram.square.is_finite() && gram.matrix.iter().all(|x| x.is_finite())).then_some(gram)
    }

    /// Sets the torque of every motion to what a fit predicts of it; the inertial parameters are those that were seen last.
    pub fn fill_torque(&mut self, fit: &Fit) {
        for m in 0..self.motions.len() {
            let mut torque = self.load[m].clone();
            // What a motor carries of another joint is of what that joint's motor carries by itself.
            for coupled in [false, true] {
                let alone = torque.clone();
                self.motions[m].torque = alone;
                for (term, place) in
                    fit.structure.terms.iter().zip(&fit.places).filter(|(t, _)| (t.physics == Physics::Coupling) == coupled)
                {
                    let values = &fit.values[place.clone()];
                    for (signals, value) in self.sight(m, &fit.structure.slip).columns(term).iter().zip(values) {
                        for (j, signal) in signals {
                            torque[*j].iter_mut().zip(signal).for_each(|(t, s)| *t += value * s);
                        }
                    }
                }
            }
            self.motions[m].torque = torque;
        }
    }
}
