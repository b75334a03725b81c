//! Friction contacts solved directly: those that stick by one factorisation, which is kept while the same ones stick.
//!
//! A sliding contact has the force of its level, one that sticks whatever keeps its ends together. The sticking set is first taken from the last substep.
//! A force beyond its level then lets a contact slide, and a velocity against its force stops it, until all agree. This is a Newton method for the
//! box-constrained problem (M. Hintermüller, K. Ito and K. Kunisch, SIAM J. Optim. 13 (2002) 865).

use super::constraints::{Constraints, Work};
use super::contact::Bounds;
use super::sticking::Sticking;

/// Changes of the set at most; then Gauss-Seidel begins at the start.
const CHANGES: usize = 8;

impl Constraints {
    /// Adds to the forces of the set what takes away the velocities across its contacts. Where they depend much on each other twice: the second time what
    /// rounding left.
    #[inline]
    fn hold(&self, work: &mut Work, sticking: &mut Sticking) {
        let count = sticking.count;
        for _ in 0..if sticking.inverted { 1 } else { 2 } {
            for (right, c) in sticking.right.iter_mut().zip(&sticking.set[..count]) {
                *right = self.velocity(*c, work);
            }
            if sticking.inverted {
                for (row, c) in sticking.set[..count].iter().enumerate() {
                    work.force[*c] += sticking.answer(&sticking.right[..count], row);
                }
                continue;
            }
            sticking.solve();
            for ((c, more), kept) in sticking.set[..count].iter().zip(&sticking.right).zip(&sticking.kept) {
                if *kept {
                    work.force[*c] += more;
                }
            }
        }
    }

    /// All friction contacts at once, where there are no other constraints. `false` where contacts depend on each other (several in one place) or the set
    /// does not settle.
    pub(super) fn solve_contacts(&self, work: &mut Work) -> bool {
        let Some(mut sticking) = work.sticking.take() else { return false };
        for c in 0..self.frictions {
            // Bounds may have changed since.
            work.force[c] = work.force[c].min(work.bounds[c].high).max(work.bounds[c].low);
            sticking.start[c] = work.force[c];
        }
        let settled = self.settle_set(work, &mut sticking);
        if !settled {
            work.force[..self.frictions].copy_from_slice(&sticking.start);
        }
        work.sticking = Some(sticking);
        settled
    }

    fn settle_set(&self, work: &mut Work, sticking: &mut Sticking) -> bool {
        let inside = |work: &Work, c: usize| work.force[c] > work.bounds[c].low && work.force[c] < work.bounds[c].high;
        sticking.gather((0..self.frictions).filter(|c| inside(work, *c)));
        for _ in 0..CHANGES {
            sticking.factorise(self.changes, |c, d| self.compliance(c, d));
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
        let Some(mut sticking) = work.sticking.take() else { return };
        sticking.gather((0..self.frictions).filter(|c| work.force[*c] > work.bounds[*c].low && work.force[*c] < work.bounds[*c].high));
        sticking.factorise(self.changes, |c, d| self.compliance(c, d));
        for (right, c) in sticking.right.iter_mut().zip(&sticking.set[..sticking.count]) {
            *right = self.velocity(*c, work);
        }
        sticking.solve();
        for ((c, more), _) in sticking.set[..sticking.count].iter().zip(&sticking.right).zip(&sticking.kept).filter(|(_, kept)| **kept) {
            let Bounds { low, high } = work.bounds[*c];
            work.force[*c] = (work.force[*c] + more).min(high).max(low);
        }
        work.sticking = Some(sticking);
    }
}
