//! Friction contacts solved directly: those that stick by one factorisation, which is kept while the same ones stick.
//!
//! A sliding contact has the force of its level, one that sticks whatever keeps its ends together. Which ones stick is first taken to be as it was in the
//! last substep; a force beyond its level then lets a contact slide, a velocity against its force stops it, until all agree (a Newton method for the
//! box-constrained problem; M. Hintermüller, K. Ito and K. Kunisch, SIAM J. Optim. 13 (2002) 865).

use super::constraints::{Constraints, Work};
use super::contact::Bounds;

/// Changes of the set at most; then Gauss-Seidel begins at the start.
const CHANGES: usize = 8;
/// A pivot below this share of its diagonal: a contact that depends on others.
const DEPENDS: f64 = 1e-10;

/// The contacts that stick, and the Cholesky factor of the compliance between them. Its space is of a fixed size.
#[derive(Debug, Clone, Default)]
pub(super) struct Sticking {
    /// The first `count` of these.
    set: Vec<usize>,
    count: usize,
    /// Row by row, as wide as there are contacts.
    factor: Vec<f64>,
    /// Of each in the set, whether it does not depend on those before.
    kept: Vec<bool>,
    right: Vec<f64>,
    /// Forces to begin with.
    start: Vec<f64>,
    /// Whether the factor is that of `set`, and of how often the compliance had changed.
    factored: Option<u64>,
    width: usize,
}

impl Sticking {
    /// Space for so many contacts.
    pub(super) fn new(contacts: usize) -> Sticking {
        Sticking {
            set: vec![0; contacts],
            count: 0,
            factor: vec![0.0; contacts * contacts],
            kept: vec![true; contacts],
            right: vec![0.0; contacts],
            start: vec![0.0; contacts],
            factored: None,
            width: contacts,
        }
    }

    /// The set is now this; what was factored stays where it is the same.
    fn gather(&mut self, contacts: impl Iterator<Item = usize>) {
        let mut count = 0;
        for c in contacts {
            if count >= self.count || self.set[count] != c {
                self.set[count] = c;
                self.factored = None;
            }
            count += 1;
        }
        if self.count != count {
            self.factored = None;
        }
        self.count = count;
    }

    fn factorise(&mut self, constraints: &Constraints) {
        if self.factored == Some(constraints.changes) {
            return;
        }
        let (count, width) = (self.count, self.width);
        for j in 0..count {
            let (row_j, own) = (j * width, constraints.own_compliance(self.set[j]));
            let mut pivot = own;
            for k in (0..j).filter(|k| self.kept[*k]) {
                pivot -= self.factor[row_j + k] * self.factor[row_j + k];
            }
            self.kept[j] = pivot > DEPENDS * own;
            if !self.kept[j] {
                continue;
            }
            self.factor[row_j + j] = pivot.sqrt();
            for i in j + 1..count {
                let mut sum = constraints.compliance(self.set[i], self.set[j]);
                for k in (0..j).filter(|k| self.kept[*k]) {
                    sum -= self.factor[i * width + k] * self.factor[row_j + k];
                }
                self.factor[i * width + j] = sum / self.factor[row_j + j];
            }
        }
        self.factored = Some(constraints.changes);
    }

    /// `right` becomes what to add to the forces of the set to take these velocities away.
    fn solve(&mut self) {
        let (count, width) = (self.count, self.width);
        for i in (0..count).filter(|i| self.kept[*i]) {
            let mut sum = self.right[i];
            for k in (0..i).filter(|k| self.kept[*k]) {
                sum -= self.factor[i * width + k] * self.right[k];
            }
            self.right[i] = sum / self.factor[i * width + i];
        }
        for i in (0..count).rev().filter(|i| self.kept[*i]) {
            let mut sum = self.right[i];
            for k in (i + 1..count).filter(|k| self.kept[*k]) {
                sum -= self.factor[k * width + i] * self.right[k];
            }
            self.right[i] = sum / self.factor[i * width + i];
        }
    }
}

impl Constraints {
    /// Adds to the forces of the set what takes away the velocities across its contacts. Twice: the second time what rounding left.
    fn hold(&self, work: &mut Work, sticking: &mut Sticking) {
        for _ in 0..2 {
            for (right, c) in sticking.right.iter_mut().zip(&sticking.set[..sticking.count]) {
                *right = self.velocity(*c, work);
            }
            sticking.solve();
            for ((c, more), kept) in sticking.set[..sticking.count].iter().zip(&sticking.right).zip(&sticking.kept) {
                if *kept {
                    work.force[*c] += more;
                }
            }
        }
    }

    /// All friction contacts at once, where there are no other constraints. `false` where contacts depend on each other (several in one place) or the set
    /// does not settle.
    pub(super) fn solve_contacts(&self, work: &mut Work) -> bool {
        let mut sticking = std::mem::take(&mut work.sticking);
        for c in 0..self.frictions {
            // Bounds may have changed since.
            work.force[c] = work.force[c].min(work.bounds[c].high).max(work.bounds[c].low);
            sticking.start[c] = work.force[c];
        }
        let settled = self.settle_set(work, &mut sticking);
        if !settled {
            work.force[..self.frictions].copy_from_slice(&sticking.start);
        }
        work.sticking = sticking;
        settled
    }

    fn settle_set(&self, work: &mut Work, sticking: &mut Sticking) -> bool {
        let inside = |work: &Work, c: usize| work.force[c] > work.bounds[c].low && work.force[c] < work.bounds[c].high;
        sticking.gather((0..self.frictions).filter(|c| inside(work, *c)));
        for _ in 0..CHANGES {
            sticking.factorise(self);
            if sticking.kept[..sticking.count].iter().any(|kept| !kept) {
                return false;
            }
            let mut agreed = true;
            if sticking.count > 0 {
                self.hold(work, sticking);
                for c in &sticking.set[..sticking.count] {
                    let Bounds { low, high } = work.bounds[*c];
                    let held = work.force[*c];
                    if !(held > low && held < high) {
                        work.force[*c] = held.min(high).max(low);
                        agreed = false;
                    }
                }
            }
            if !agreed {
                // With the others beyond their levels it is not known which of those that slide would stop.
                sticking.gather((0..self.frictions).filter(|c| inside(work, *c)));
                continue;
            }
            for c in 0..self.frictions {
                let Bounds { low, high } = work.bounds[c];
                if low == high || inside(work, c) {
                    continue;
                }
                let velocity = self.velocity(c, work);
                let own = self.own_compliance(c);
                if own <= 0.0 {
                    return false;
                }
                let against = if work.force[c] >= high { velocity < 0.0 } else { velocity > 0.0 };
                if against {
                    let wanted = work.force[c] + velocity / own;
                    // Next to its level it would count as sliding again: the middle is as good to start from.
                    work.force[c] = if wanted > low && wanted < high { wanted } else { 0.5 * (low + high) };
                    agreed = agreed && !inside(work, c);
                }
            }
            if agreed {
                return true;
            }
            sticking.gather((0..self.frictions).filter(|c| inside(work, *c)));
        }
        false
    }

    /// Newton step for the contacts inside their bounds: makes all of them stick at once. Contacts that depend on others keep their force.
    pub(super) fn make_stick(&self, work: &mut Work) {
        let mut sticking = std::mem::take(&mut work.sticking);
        sticking.gather((0..self.frictions).filter(|c| work.force[*c] > work.bounds[*c].low && work.force[*c] < work.bounds[*c].high));
        sticking.factorise(self);
        for (right, c) in sticking.right.iter_mut().zip(&sticking.set[..sticking.count]) {
            *right = self.velocity(*c, work);
        }
        sticking.solve();
        for ((c, more), _) in sticking.set[..sticking.count].iter().zip(&sticking.right).zip(&sticking.kept).filter(|(_, kept)| **kept) {
            let Bounds { low, high } = work.bounds[*c];
            work.force[*c] = (work.force[*c] + more).min(high).max(low);
        }
        work.sticking = sticking;
    }
}
