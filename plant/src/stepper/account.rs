//! What has been counted of work and losses since the start.

use super::compiled::{Compiled, Share};
use super::contact::FrictionContact;
use super::drive::Drive;
use super::path::PathElement;
use super::slots::{GROUND, Slots};

/// What has been counted since the start.
#[derive(Debug, Clone, Default)]
pub(super) struct Account {
    pub(super) work_in: f64,
    pub(super) dissipated: f64,
    pub(super) stored_in_paths_first: f64,
    /// Taken by each element of the model; of those along a path the plant keeps its own count.
    pub(super) taken: Vec<f64>,
    /// Stored in each path element at the start.
    pub(super) stored_first: Vec<f64>,
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
    /// What the links of a robot push back with.
    pub(super) bias: &'a Slots,
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
            pull[i] = done.bias[i] - pull[i] - fixed.constant[i];
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
        fixed.points.pass_on(&mut pull);
        let places = || (0..fixed.free).chain(GROUND - fixed.prescribed..GROUND);
        for i in fixed.points.places() {
            self.work_in += done.pushed[i] * done.mean_velocity[i] * h;
        }
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
