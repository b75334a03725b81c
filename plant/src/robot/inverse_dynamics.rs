//! What force a motion takes: the recursive Newton-Euler algorithm (RBDA, table 5.1).

use super::spatial::{Twist, Wrench};
use super::tree::{Tree, Workspace};
use nalgebra::Vector3;

impl Tree {
    /// Forces of the joints that make them accelerate so, N m or N: `M(q) a + c(q, v) + g(q)`, with coordinates q (rad, m), rates v and accelerations a.
    pub fn inverse_dynamics(&self, coordinates: &[f64], rates: &[f64], accelerations: &[f64], work: &mut Workspace, forces: &mut [f64]) {
        self.velocities(coordinates, rates, work);
        self.newton_euler(rates, Some(accelerations), self.gravity, work, forces);
    }

    /// Forces that keep the rates as they are: `c(q, v) + g(q)`, N m or N.
    pub fn bias(&self, coordinates: &[f64], rates: &[f64], work: &mut Workspace, forces: &mut [f64]) {
        self.velocities(coordinates, rates, work);
        self.bias_here(rates, work, forces);
    }

    /// The same of the bodies as they move, at these rates.
    pub(crate) fn bias_here(&self, rates: &[f64], work: &mut Workspace, forces: &mut [f64]) {
        self.newton_euler(rates, None, self.gravity, work, forces);
    }

    /// Coriolis and centrifugal forces alone: `c(q, v)`, N m or N.
    pub fn coriolis(&self, coordinates: &[f64], rates: &[f64], work: &mut Workspace, forces: &mut [f64]) {
        self.velocities(coordinates, rates, work);
        self.newton_euler(rates, None, Vector3::zeros(), work, forces);
    }

    /// Forces that hold the robot still: `g(q)`, N m or N.
    pub fn gravity(&self, coordinates: &[f64], work: &mut Workspace, forces: &mut [f64]) {
        self.place(coordinates, work);
        self.gravity_here(work, forces);
    }

    /// The same of the bodies where they are.
    pub(crate) fn gravity_here(&self, work: &mut Workspace, forces: &mut [f64]) {
        let lift = Twist { angular: Vector3::zeros(), linear: -self.gravity };
        for (i, body) in self.bodies.iter().enumerate() {
            let outside = body.parent.map_or(lift, |parent| work.acceleration[parent]);
            work.acceleration[i] = work.in_parent[i].twist_inside(&outside);
            work.force[i] = body.inertia.times(&work.acceleration[i]);
        }
        self.gather(work, forces);
    }

    #[inline]
    fn newton_euler(&self, rates: &[f64], accelerations: Option<&[f64]>, gravity: Vector3<f64>, work: &mut Workspace, forces: &mut [f64]) {
        // As if the base were lifted against gravity.
        let lift = Twist { angular: Vector3::zeros(), linear: -gravity };
        for (i, body) in self.bodies.iter().enumerate() {
            let outside = body.parent.map_or(lift, |parent| work.acceleration[parent]);
            let velocity = work.velocity[i];
            let mut acceleration = work.in_parent[i].twist_inside(&outside) + velocity.cross(&(body.axis * rates[i]));
            if let Some(accelerations) = accelerations {
                acceleration = acceleration + body.axis * accelerations[i];
            }
            work.acceleration[i] = acceleration;
            work.force[i] = body.inertia.times(&acceleration) + velocity.cross_force(&body.inertia.times(&velocity));
        }
        self.gather(work, forces);
        if let Some(accelerations) = accelerations {
            for (i, body) in self.bodies.iter().enumerate() {
                forces[i] += body.armature * accelerations[i];
            }
        }
    }

    /// Each joint carries what its body and those beyond need.
    #[inline]
    fn gather(&self, work: &mut Workspace, forces: &mut [f64]) {
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let force: Wrench = work.force[i];
            forces[i] = body.axis.dot(&force);
            if let Some(parent) = body.parent {
                work.force[parent] += work.in_parent[i].wrench_outside(&force);
            }
        }
    }
}
