//! Energies of a tree.

use super::tree::{Tree, Workspace};

impl Tree {
    /// Kinetic energy of all bodies and armatures, J.
    pub fn kinetic_energy(&self, coordinates: &[f64], rates: &[f64], work: &mut Workspace) -> f64 {
        self.velocities(coordinates, rates, work);
        let of = |i: usize| {
            let (body, velocity) = (&self.bodies[i], &work.velocity[i]);
            0.5 * (velocity.dot(&body.inertia.times(velocity)) + body.armature * rates[i] * rates[i])
        };
        (0..self.len()).map(of).sum()
    }

    /// Energy in gravity, J; 0 where all centres of mass were at the origin of the base.
    pub fn potential_energy(&self, coordinates: &[f64], work: &mut Workspace) -> f64 {
        self.place(coordinates, work);
        self.potential_energy_here(work)
    }

    /// The same of the bodies where they are.
    pub(crate) fn potential_energy_here(&self, work: &Workspace) -> f64 {
        let of = |i: usize| {
            let (inertia, place) = (&self.bodies[i].inertia, &work.in_base[i]);
            -self.gravity.dot(&(place.rotation * inertia.first_moment + inertia.mass * place.translation))
        };
        (0..self.len()).map(of).sum()
    }
}
