//! The friction contacts that stick, and the factor that solves for their forces at once; kept while the same ones stick.

/// A pivot below this share of its diagonal: a contact that depends on others.
const DEPENDS: f64 = 1e-10;

/// A set whose pivots all exceed this share of their diagonals is solved to a few roundings by its inverse, in one pass.
const APART: f64 = 1e-3;

/// Contacts in a set for which the inverse is kept; solving with the factor of more takes fewer operations.
const INVERTED: usize = 8;

/// The contacts that stick, and the Cholesky factor of the compliance between them. Its space is of a fixed size.
#[derive(Debug, Clone)]
pub(super) struct Sticking {
    /// The first `count` of these.
    pub(super) set: Vec<usize>,
    pub(super) count: usize,
    /// Row by row, as wide as there are contacts.
    factor: Vec<f64>,
    /// Of small sets whose contacts are well apart, row by row without gaps.
    inverse: [f64; INVERTED * INVERTED],
    /// Whether the inverse is that of `set`.
    pub(super) inverted: bool,
    /// Of each in the set, whether it does not depend on those before.
    pub(super) kept: Vec<bool>,
    pub(super) right: Vec<f64>,
    /// Forces to begin with.
    pub(super) start: Vec<f64>,
    /// Whether the factor is that of `set`, and of how often the compliance had changed.
    factored: Option<u64>,
    width: usize,
}

impl Sticking {
    /// Space for this number of contacts.
    pub(super) fn new(contacts: usize) -> Sticking {
        Sticking {
            set: vec![0; contacts],
            count: 0,
            factor: vec![0.0; contacts * contacts],
            inverse: [0.0; INVERTED * INVERTED],
            inverted: false,
            kept: vec![true; contacts],
            right: vec![0.0; contacts],
            start: vec![0.0; contacts],
            factored: None,
            width: contacts,
        }
    }

    /// The set is now this; what was factored stays where it is the same.
    pub(super) fn gather(&mut self, contacts: impl Iterator<Item = usize>) {
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

    /// The factor of the set's compliance; `changes` counts how often it has changed.
    pub(super) fn factorise(&mut self, changes: u64, compliance: impl Fn(usize, usize) -> f64) {
        if self.factored == Some(changes) {
            return;
        }
        let (count, width) = (self.count, self.width);
        let mut apart = count <= INVERTED;
        for j in 0..count {
            let (row_j, own) = (j * width, compliance(self.set[j], self.set[j]));
            let mut pivot = own;
            for k in (0..j).filter(|k| self.kept[*k]) {
                pivot -= self.factor[row_j + k] * self.factor[row_j + k];
            }
            self.kept[j] = pivot > DEPENDS * own;
            apart &= pivot > APART * own;
            if !self.kept[j] {
                continue;
            }
            self.factor[row_j + j] = pivot.sqrt();
            for i in j + 1..count {
                let mut sum = compliance(self.set[i], self.set[j]);
                for k in (0..j).filter(|k| self.kept[*k]) {
                    sum -= self.factor[i * width + k] * self.factor[row_j + k];
                }
                self.factor[i * width + j] = sum / self.factor[row_j + j];
            }
        }
        self.factored = Some(changes);
        self.inverted = apart;
        if apart {
            for column in 0..count {
                self.right[..count].fill(0.0);
                self.right[column] = 1.0;
                self.solve();
                for row in 0..count {
                    self.inverse[row * count + column] = self.right[row];
                }
            }
        }
    }

    /// The same as `right` after [`Sticking::solve`] for these velocities, of a set that has its inverse.
    #[inline]
    pub(super) fn answer(&self, velocities: &[f64], row: usize) -> f64 {
        let of_row = &self.inverse[row * self.count..(row + 1) * self.count];
        of_row.iter().zip(velocities).map(|(a, u)| a * u).sum()
    }

    /// `right` becomes what to add to the forces of the set to take these velocities away.
    pub(super) fn solve(&mut self) {
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
