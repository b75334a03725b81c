//! Where the energy went.

use super::account::Account;
use super::compiled::Share;
use super::path::PathElement;
use super::slots::GROUND;
use super::state::Plant;

/// Energies of a plant, J. Until [`Plant::track_energy`] is called, `work_in` and `dissipated` are not numbers:
/// not measured is not zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Of all bodies, links and inerters, now.
    pub kinetic: f64,
    /// In springs, contacts, bristles, biases and gravity, now; 0 where every displacement and memory is 0.
    pub stored: f64,
    /// Put in by force and motion inputs since the start.
    pub work_in: f64,
    /// Taken by dampers (back-EMF among them), friction and hysteresis since the start.
    pub dissipated: f64,
}

impl Plant {
    /// Counts the work of inputs, dampers and friction from the next start on, and restarts. It costs time; a linear model is then stepped by
    /// substeps instead of exactly, so its number of substeps should be given.
    pub fn track_energy(&mut self) {
        self.energy = Some(Account::default());
        self.reset();
    }

    /// Energies now.
    pub fn energy(&self) -> Energy {
        let fixed = &self.fixed;
        let lifted = self.links.as_ref().map_or(0.0, |links| links.potential);
        let (mut kinetic, mut stored) = (0.0, self.stored_in_paths() + lifted);
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

    /// Energy taken by one element of the model since the start, J (of hysteresis: the input less what it still holds). Not a number until
    /// [`Plant::track_energy`] is called, and where there is no such element.
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
