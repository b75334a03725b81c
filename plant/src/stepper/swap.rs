//! Replaces the network at work by another one, which continues from the same state.

use super::state::Plant;

impl Plant {
    /// Exchanges its laws with those of `other`; positions, velocities and memories stay where they are. Nothing is allocated. Both must be compiled
    /// of one structure (the same bodies, elements, inputs and outputs; only numbers differ), for the same period and substeps; where they are not,
    /// nothing happens and the answer is `false`.
    pub fn exchange_laws(&mut self, other: &mut Plant) -> bool {
        let alike = self.fixed.slots == other.fixed.slots
            && self.fixed.elements.len() == other.fixed.elements.len()
            && self.paths.len() == other.paths.len()
            && self.frictions.len() == other.frictions.len()
            && self.period == other.period
            && self.substeps == other.substeps
            && self.exact.is_some() == other.exact.is_some()
            && self.links.is_some() == other.links.is_some();
        if !alike {
            return false;
        }
        std::mem::swap(&mut self.fixed, &mut other.fixed);
        // What was factored was of the other's compliance.
        (self.fixed.constraints.changes, other.fixed.constraints.changes) =
            (other.fixed.constraints.changes.wrapping_add(1), self.fixed.constraints.changes.wrapping_add(1));
        std::mem::swap(&mut self.exact, &mut other.exact);
        std::mem::swap(&mut self.links, &mut other.links);
        self.links_here();
        other.links_here();
        for (mine, theirs) in self.paths.iter_mut().zip(&mut other.paths) {
            std::mem::swap(&mut mine.law, &mut theirs.law);
            std::mem::swap(&mut mine.constraint, &mut theirs.constraint);
            std::mem::swap(&mut mine.ahead, &mut theirs.ahead);
            std::mem::swap(&mut mine.unresolved, &mut theirs.unresolved);
        }
        for (mine, theirs) in self.frictions.iter_mut().zip(&mut other.frictions) {
            std::mem::swap(&mut mine.law, &mut theirs.law);
            std::mem::swap(&mut mine.joint, &mut theirs.joint);
            std::mem::swap(&mut mine.constant, &mut theirs.constant);
        }
        true
    }
}
