//! The equations of a substep of a large network: few bodies are tied to each other, so few coefficients are not 0.
//!
//! `A = L D Lᵀ` in an order in which little is filled in: always the body with the fewest neighbours next (minimum degree; A. George and J. Liu, SIAM Rev. 31
//! (1989) 1). Of a chain or a tree nothing is filled in, and a substep costs as much as there are bodies.

use super::slots::{SLOTS, Slots, Square};
use nalgebra::DMatrix;

/// Free bodies up to which full matrices are quicker.
pub(super) const SMALL: usize = 8;

/// What is solved in each substep, and what its right side is made of.
#[derive(Debug, Clone)]
pub(super) struct Sparse {
    /// Stiffness, and the coefficient of the velocity: `(i, j, K, D + h K/2)`.
    entries: Vec<(usize, usize, f64, f64)>,
    /// Free bodies in the order of their elimination, with 1/D and where their part of `lower` ends.
    order: Vec<(usize, f64, usize)>,
    /// Columns of L one after the other: body, and factor.
    lower: Vec<(usize, f64)>,
}

impl Sparse {
    /// `None` where the network is small or dense enough for full matrices, or a pivot vanishes.
    pub(super) fn new(system: &DMatrix<f64>, stiffness: &Square, damping: &Square, substep: f64) -> Option<Sparse> {
        let n = system.nrows();
        if n <= SMALL || n > SLOTS {
            return None;
        }
        let entries = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .filter(|(i, j)| stiffness[*i][*j] != 0.0 || damping[*i][*j] != 0.0)
            .map(|(i, j)| (i, j, stiffness[i][j], damping[i][j] + 0.5 * substep * stiffness[i][j]))
            .collect();
        let mut rest = system.clone();
        let mut left = vec![true; n];
        let (mut order, mut lower) = (Vec::with_capacity(n), Vec::new());
        for _ in 0..n {
            let neighbours = |i: usize| (0..n).filter(|j| left[*j] && *j != i && rest[(i, *j)] != 0.0).count();
            let next = (0..n).filter(|i| left[*i]).min_by_key(|i| neighbours(*i))?;
            left[next] = false;
            let pivot = rest[(next, next)];
            if !pivot.is_finite() || pivot.abs() <= 1e-13 * system[(next, next)].abs() {
                return None;
            }
            let column: Vec<(usize, f64)> =
                (0..n).filter(|i| left[*i] && rest[(*i, next)] != 0.0).map(|i| (i, rest[(i, next)] / pivot)).collect();
            for (i, by) in &column {
                for (j, _) in &column {
                    let other = rest[(next, *j)];
                    rest[(*i, *j)] -= by * other;
                }
            }
            lower.extend(column);
            order.push((next, 1.0 / pivot, lower.len()));
        }
        (4 * lower.len() < n * n).then_some(Sparse { entries, order, lower })
    }

    /// `A⁻¹ right`, in its place.
    #[inline]
    pub(super) fn solve(&self, right: &mut Slots) {
        let mut start = 0;
        for (body, _, end) in &self.order {
            let value = right[*body];
            for (i, by) in &self.lower[start..*end] {
                right[*i] -= by * value;
            }
            start = *end;
        }
        for (index, (body, inverse, end)) in self.order.iter().enumerate().rev() {
            let start = index.checked_sub(1).map_or(0, |before| self.order[before].2);
            let value = right[*body] * inverse;
            right[*body] = self.lower[start..*end].iter().fold(value, |value, (i, by)| value - by * right[*i]);
        }
    }

    /// Half the change of the velocities under forces, from these positions and velocities on, without bodies on motion inputs.
    #[inline]
    pub(super) fn change(&self, force: &Slots, x: &Slots, v: &Slots) -> Slots {
        let mut change = *force;
        for (i, j, by_position, by_velocity) in &self.entries {
            change[*i] -= by_position * x[*j] + by_velocity * v[*j];
        }
        self.solve(&mut change);
        change
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_solved_without_filling_in() {
        let n = 40;
        let (mut stiffness, damping) = (Box::new([[0.0; SLOTS]; SLOTS]), Box::new([[0.0; SLOTS]; SLOTS]));
        let mut system = DMatrix::from_diagonal_element(n, n, 2.5);
        // Each hangs on one before it, several on some.
        for i in 1..n {
            let (j, k) = (7 * i % 11 * i / 11, 1.0 + (i as f64).sin().abs());
            let j = j.min(i - 1);
            for (a, b, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                stiffness[a][b] += sign * k;
                system[(a, b)] += sign * k;
            }
        }
        let sparse = Sparse::new(&system, &stiffness, &damping, 0.1).unwrap();
        assert_eq!(sparse.lower.len(), n - 1, "nothing is filled in");
        let mut right: Slots = [0.0; SLOTS];
        (0..n).for_each(|i| right[i] = (3.7 * i as f64).cos());
        let mut solution = right;
        sparse.solve(&mut solution);
        for i in 0..n {
            let left: f64 = (0..n).map(|j| system[(i, j)] * solution[j]).sum();
            assert!((left - right[i]).abs() < 1e-12, "{i}");
        }
    }
}
