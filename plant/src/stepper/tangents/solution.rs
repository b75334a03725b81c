//! Derivatives of the forces of dry friction and of elements that are solved implicitly.

use super::lane::Across;
use crate::stepper::constraints::Constraints;

/// Derivatives of the forces of all constraints over a substep, and space to find them.
#[derive(Debug, Clone)]
pub(super) struct Solution<const W: usize> {
    pub(super) force: Vec<Across<W>>,
    /// Derivatives of a contact's lowest and highest force.
    pub(super) low: Vec<Across<W>>,
    pub(super) high: Vec<Across<W>>,
    /// Slope of a path's force over its mean velocity, and what the parameters change of the force at the same velocity.
    pub(super) slope: Vec<f64>,
    pub(super) direct: Vec<Across<W>>,
    /// Derivatives of the velocities by which constraints are solved, without any of their forces.
    pub(super) base: Vec<Across<W>>,
    pub(super) unknown: Vec<usize>,
    pub(super) matrix: Vec<f64>,
    pub(super) right: Vec<Across<W>>,
}

impl<const W: usize> Solution<W> {
    /// Solves for the unknown forces; the others are known. A contact sticks: its ends stay together. A path's force follows its velocity.
    pub(super) fn solve(&mut self, constraints: &Constraints, frictions: usize) {
        let k = self.unknown.len();
        if let ([c], 1) = (&self.unknown[..], constraints.len()) {
            let (own, c) = (constraints.own_compliance(*c), *c);
            for l in 0..W {
                let (base, direct) = (self.base[c][l], self.direct[c][l]);
                self.force[c][l] = match own {
                    _ if c >= frictions => (self.slope[c] * base + direct) / (1.0 + self.slope[c] * own),
                    _ if own > 0.0 => base / own,
                    _ => 0.0,
                };
            }
            return;
        }
        self.matrix.clear();
        self.matrix.resize(k * k, 0.0);
        self.right.clear();
        let known = |c: usize| !self.unknown.contains(&c);
        for (row, c) in self.unknown.iter().enumerate() {
            let mut right = self.base[*c];
            for d in (0..constraints.len()).filter(|d| known(*d)) {
                let p = constraints.compliance(*c, d);
                (0..W).for_each(|l| right[l] -= p * self.force[d][l]);
            }
            let factor = if *c < frictions { 1.0 } else { self.slope[*c] };
            for (column, d) in self.unknown.iter().enumerate() {
                self.matrix[row * k + column] = factor * constraints.compliance(*c, *d);
            }
            if *c >= frictions {
                self.matrix[row * k + row] += 1.0;
                (0..W).for_each(|l| right[l] = factor * right[l] + self.direct[*c][l]);
            }
            self.right.push(right);
        }
        self.eliminate(k);
        for (row, c) in self.unknown.iter().enumerate() {
            self.force[*c] = self.right[row];
        }
    }

    /// Gauss elimination from the first row on: the equations of contacts are symmetric, and those of paths are near to 1. Of contacts in one place, whose
    /// equations are the same, the first holds.
    fn eliminate(&mut self, k: usize) {
        for i in 0..k {
            let pivot = self.matrix[i * k + i];
            let holds = pivot.abs() > 1e-12 * (0..k).map(|j| self.matrix[i * k + j].abs()).fold(f64::MIN_POSITIVE, f64::max);
            for row in i + 1..k {
                let factor = if holds { self.matrix[row * k + i] / pivot } else { 0.0 };
                if factor != 0.0 {
                    for column in i..k {
                        self.matrix[row * k + column] -= factor * self.matrix[i * k + column];
                    }
                    let above = self.right[i];
                    (0..W).for_each(|l| self.right[row][l] -= factor * above[l]);
                }
            }
        }
        for i in (0..k).rev() {
            let pivot = self.matrix[i * k + i];
            let holds = pivot.abs() > 1e-12 * (i..k).map(|j| self.matrix[i * k + j].abs()).fold(f64::MIN_POSITIVE, f64::max);
            for j in i + 1..k {
                let (factor, below) = (self.matrix[i * k + j], self.right[j]);
                (0..W).for_each(|l| self.right[i][l] -= factor * below[l]);
            }
            self.right[i] = if holds { self.right[i].map(|r| r / pivot) } else { [0.0; W] };
        }
    }
}
