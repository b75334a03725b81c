//! Where the energy went.

use super::compile::{Compiled, Share};
use super::drive::Drive;
use super::{FrictionContact, GROUND, PathElement, Plant, Slots};
use crate::elements::Mechanics;

/// Energies of a plant, J. Until [`Plant::track_energy`] is called, `work_in` and `dissipated` are not numbers:
/// not measured is not zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Of all bodies and inerters, now.
    pub kinetic: f64,
    /// In springs, contacts, bristles and biases, now; 0 where every displacement and memory is 0.
    pub stored: f64,
    /// Put in by force and motion inputs since the start.
    pub work_in: f64,
    /// Taken by dampers (back-EMF among them), friction and hysteresis since the start.
    pub dissipated: f64,
}

/// What has been counted since the start.
#[derive(Debug, Clone, Default)]
pub(super) struct Account {
    work_in: f64,
    dissipated: f64,
    stored_in_paths_first: f64,
    /// Taken by each element of the model; of those along a path the plant keeps its own count.
    taken: Vec<f64>,
    /// Stored in each path element at the start.
    stored_first: Vec<f64>,
}

/// A substep that has been done.
pub(super) struct Done<'a> {
    /// Velocity before it.
    pub(super) velocity: &'a Slots,
    /// Position in its middle; of free bodies, as predicted.
    pub(super) middle: &'a Slots,
    /// Mean velocity.
    pub(super) mean_velocity: &'a Slots,
    /// Velocity after it.
    pub(super) end_velocity: &'a Slots,
    /// Mean force of the force inputs on each place.
    pub(super) pushed: &'a Slots,
    /// Its length, s.
    pub(super) length: f64,
}

impl Account {
    pub(super) fn count(
        &mut self,
        fixed: &Compiled,
        drives: &[Drive],
        frictions: &[FrictionContact],
        paths: &mut [PathElement],
        done: &Done,
    ) {
        let h = done.length;
        let apart = |first: usize, second: usize| done.mean_velocity[first] - done.mean_velocity[second];
        for (share, taken) in fixed.elements.iter().zip(&mut self.taken) {
            *taken += match *share {
                Share::Linear(linear, first, second) => linear.damping * apart(first, second).powi(2) * h,
                Share::Friction(index) => {
                    frictions.get(index).map_or(0.0, |contact| contact.force * apart(contact.first, contact.second) * h)
                }
                Share::Path(_) => 0.0,
            };
        }
        // What friction and path elements do to the prescribed bodies.
        let mut pull = *done.pushed;
        for i in 0..pull.len() {
            pull[i] = -pull[i] - fixed.constant[i];
        }
        for contact in frictions {
            self.dissipated += contact.force * (done.mean_velocity[contact.first] - done.mean_velocity[contact.second]) * h;
            pull[contact.first] += contact.force;
            pull[contact.second] -= contact.force;
        }
        for path in paths {
            path.absorbed += path.force * (done.mean_velocity[path.first] - done.mean_velocity[path.second]) * h;
            pull[path.first] += path.force;
            pull[path.second] -= path.force;
        }
        let places = || (0..fixed.free).chain(GROUND - fixed.prescribed..GROUND);
        for i in places() {
            self.work_in += done.pushed[i] * done.mean_velocity[i] * h;
            for j in places() {
                self.dissipated += done.mean_velocity[i] * fixed.damping[i][j] * done.mean_velocity[j] * h;
            }
        }
        for drive in drives.iter().filter(|drive| drive.moves) {
            let slot = drive.slot;
            let mut reaction = pull[slot];
            for j in places() {
                let gained = done.end_velocity[j] - done.velocity[j];
                let share = if j < fixed.free { fixed.theta * 0.25 * h * gained } else { 0.0 };
                reaction += fixed.mass[slot][j] * gained / h
                    + fixed.damping[slot][j] * done.mean_velocity[j]
                    + fixed.stiffness[slot][j] * (done.middle[j] + share);
            }
            self.work_in += reaction * done.mean_velocity[slot] * h;
        }
    }
}

impl Plant {
    /// Counts the work of inputs, dampers and friction from the next start on, and starts anew. It costs time; a linear
    /// model is then stepped by substeps instead of exactly, so its number of substeps should be given.
    pub fn track_energy(&mut self) {
        self.energy = Some(Account::default());
        self.reset();
    }

    /// Energies now.
    pub fn energy(&self) -> Energy {
        let fixed = &self.fixed;
        let (mut kinetic, mut stored) = (0.0, self.stored_in_paths());
        for i in (0..fixed.free).chain(GROUND - fixed.prescribed..GROUND) {
            stored -= fixed.constant[i] * self.x[i];
            for j in (0..fixed.free).chain(GROUND - fixed.prescribed..GROUND) {
                kinetic += 0.5 * self.v[i] * fixed.mass[i][j] * self.v[j];
                stored += 0.5 * self.x[i] * fixed.stiffness[i][j] * self.x[j];
            }
        }
        let (work_in, dissipated) = match &self.energy {
            None => (f64::NAN, f64::NAN),
            Some(account) => {
                let absorbed: f64 = self.paths.iter().map(|path| path.absorbed).sum();
                (account.work_in, account.dissipated + absorbed - (self.stored_in_paths() - account.stored_in_paths_first))
            }
        };
        Energy { kinetic, stored, work_in, dissipated }
    }

    /// Taken by one element of the model since the start (of hysteresis: what went in less what it still holds), J; not a number
    /// until [`Plant::track_energy`] is called, and where there is no such element.
    ///
    /// What back-EMF takes belongs to an input, so the elements' sum may be less than [`Energy::dissipated`].
    pub fn dissipated_by(&self, element: usize) -> f64 {
        let (Some(account), Some(share)) = (&self.energy, self.fixed.elements.get(element)) else { return f64::NAN };
        match *share {
            Share::Linear(..) | Share::Friction(_) => account.taken.get(element).copied().unwrap_or(f64::NAN),
            Share::Path(index) => {
                let first = account.stored_first.get(index).copied().unwrap_or(0.0);
                self.paths.get(index).map_or(f64::NAN, |path| path.absorbed - (self.stored_in(path) - first))
            }
        }
    }

    fn stored_in(&self, path: &PathElement) -> f64 {
        path.law.stored(&path.memory, self.x[path.first] - self.x[path.second])
    }

    fn stored_in_paths(&self) -> f64 {
        self.paths.iter().map(|path| self.stored_in(path)).sum()
    }

    pub(super) fn restart_energy(&mut self) {
        if self.energy.is_none() {
            return;
        }
        let stored_first: Vec<f64> = self.paths.iter().map(|path| self.stored_in(path)).collect();
        let stored_in_paths_first = stored_first.iter().sum();
        let taken = vec![0.0; self.fixed.elements.len()];
        self.energy = Some(Account { stored_in_paths_first, stored_first, taken, ..Account::default() });
    }
}
