//! The equation of a joint without a motor.
//!
//! No torque sets its size: with all inertias, moments of mass and frictions halved its residual is half as large, and the motion is the same. A fit of the
//! residual in N m therefore shrinks bodies and friction, without any gain in what it predicts. The residual `e` is instead measured in the size `s` that the
//! bodies give the equation, `r = e / s`, with `s = 1` for the bodies of the file. It is linearised at the last values `x0`:
//!
//! `r(x) ≈ (left + (e0 / s0) u·x0) / s0 - (X + (e0 / s0) uᵀ) x / s0`, where `e = left - X x` and `s = 1 + u·x`.

use crate::arms::fit::{Structure, Weights};
use crate::arms::inertial::COUNT;
use crate::arms::regression::Data;
use crate::arms::system::{Column, System};
use nalgebra::{DMatrix, DVector};
use std::rc::Rc;

/// Linearisations at most.
const ROUNDS: usize = 8;
/// Change of the size from one to the next that ends them.
const SETTLED: f64 = 1e-7;
/// The least size: bodies of less are none.
const LEAST: f64 = 1e-2;

impl Data<'_> {
    /// How the size of a joint's equation follows the inertial parameters, in their sizes: the factor by which the columns of the file's bodies grow, each
    /// counted by its energy at this joint. `None` where the bodies do nothing there.
    pub(crate) fn size_of(&self, joint: usize) -> Option<DVector<f64>> {
        let bodies = &self.problem.bodies;
        let rows: Vec<usize> = (0..self.fit_count).flat_map(|m| self.layout.of(m, joint)).collect();
        let mut out = DVector::zeros(self.inertial.len());
        let mut whole = 0.0;
        for (k, (basis, nominal)) in bodies.basis.iter().zip(&bodies.nominal).enumerate() {
            let Some(inverse) = basis.try_inverse() else { continue };
            let columns = &self.inertial[k * COUNT..(k + 1) * COUNT];
            let gram = DMatrix::from_fn(COUNT, COUNT, |a, b| rows.iter().map(|row| columns[a][*row] * columns[b][*row]).sum::<f64>());
            for i in 0..COUNT {
                let of = inverse.column(i);
                let energy = (0..COUNT).map(|a| (0..COUNT).map(|b| of[a] * of[b] * gram[(a, b)]).sum::<f64>()).sum::<f64>().max(0.0);
                whole += energy * nominal[i] * nominal[i];
                (0..COUNT).for_each(|b| out[k * COUNT + b] += energy * nominal[i] * basis[(i, b)]);
            }
        }
        (whole > 0.0).then(|| out / whole)
    }

    /// The size of the equation of each joint with these values: 1 of a joint with a motor.
    pub(crate) fn sizes(&self, values: &[f64]) -> Vec<f64> {
        let of = |size: &Option<DVector<f64>>| {
            let change = size.as_ref().map_or(0.0, |u| u.iter().zip(values).map(|(u, x)| u * x).sum());
            (1.0 + change).max(LEAST)
        };
        self.size.iter().map(of).collect()
    }

    /// What the columns leave of a row with these values, N m or N.
    pub(crate) fn left_of(&self, columns: &[Column], values: &[f64], row: usize) -> f64 {
        self.torque[row] - self.nominal[row] - columns.iter().zip(values).map(|(c, x)| c[row] * x).sum::<f64>()
    }

    /// What the columns leave with these values: of a joint without a motor in the size of its equation.
    pub(crate) fn residual_with(&self, columns: &[Column], values: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = (0..self.layout.rows).map(|row| self.left_of(columns, values, row)).collect();
        for (joint, size) in self.sizes(values).into_iter().enumerate().filter(|(_, size)| *size != 1.0) {
            for m in 0..self.motions.len() {
                out[self.layout.of(m, joint)].iter_mut().for_each(|x| *x /= size);
            }
        }
        out
    }

    /// Rows and columns, those of joints without a motor linearised at these values.
    pub(crate) fn linearised(&self, columns: &[Column], structure: &Structure, weights: &Weights, values: &[f64]) -> System {
        let mut left: Vec<f64> = self.torque.iter().zip(&self.nominal).map(|(t, n)| t - n).collect();
        let mut own: Option<Vec<Column>> = None;
        if self.size.iter().any(Option::is_some) {
            let relative = self.residual_with(columns, values);
            let mut changed: Vec<Vec<f64>> = columns.iter().map(|c| c.to_vec()).collect();
            for (joint, s) in self.sizes(values).into_iter().enumerate() {
                let Some(u) = &self.size[joint] else { continue };
                let at: f64 = u.iter().zip(values).map(|(u, x)| u * x).sum();
                for row in (0..self.motions.len()).flat_map(|m| self.layout.of(m, joint)) {
                    left[row] = (left[row] + relative[row] * at) / s;
                    for (i, column) in changed.iter_mut().enumerate() {
                        column[row] = (column[row] + relative[row] * u.get(i).copied().unwrap_or(0.0)) / s;
                    }
                }
            }
            own = Some(changed.into_iter().map(Rc::new).collect());
        }
        let columns = own.as_deref().unwrap_or(columns);
        System::new(&self.layout, &self.blocks, &left, columns, structure.tolerance, weights, self.inertial.len())
    }

    /// The system of these columns and its solution, where the equations of joints without a motor are linearised.
    pub(crate) fn settled(&self, columns: &[Column], structure: &Structure, weights: &Weights) -> Option<(System, DVector<f64>)> {
        let mut values = DVector::zeros(columns.len());
        if self.size.iter().any(Option::is_some) {
            // From the bodies of the file on: what they leave is no reason to shrink them.
            let stated = Structure { tolerance: 0, ..structure.clone() };
            values = self.linearised(columns, &stated, weights, values.as_slice()).solve(None)?;
            let mut last = self.sizes(values.as_slice());
            for _ in 0..ROUNDS {
                values = self.linearised(columns, structure, weights, values.as_slice()).solve(None)?;
                let now = self.sizes(values.as_slice());
                if now.iter().zip(&last).all(|(a, b)| (a - b).abs() < SETTLED) {
                    break;
                }
                last = now;
            }
        }
        let system = self.linearised(columns, structure, weights, values.as_slice());
        let values = system.solve(None)?;
        Some((system, values))
    }
}
