//! The matrix of Coriolis forces.

use super::spatial::{Twist, Wrench};
use super::tree::{Tree, Workspace};
use nalgebra::DMatrix;

impl Tree {
    /// C(q, v), for which `C(q, v) u = C(q, u) v` is the symmetric form of the Coriolis and centrifugal forces, `C(q, v) v = c(q, v)`. It is the matrix of
    /// Christoffel symbols, so `dM/dt - 2 C` is skew. Column j is the Newton-Euler recursion for that form with the unit rate of coordinate j.
    pub fn coriolis_matrix(&self, coordinates: &[f64], rates: &[f64], work: &mut Workspace, matrix: &mut DMatrix<f64>) {
        self.velocities(coordinates, rates, work);
        self.coriolis_matrix_here(rates, work, matrix);
    }

    /// The same of the bodies as they move, at these rates.
    pub(crate) fn coriolis_matrix_here(&self, rates: &[f64], work: &mut Workspace, matrix: &mut DMatrix<f64>) {
        for j in 0..self.len() {
            let end = self.bodies[j].branch_end;
            for i in j..end {
                let body = &self.bodies[i];
                let (mut unit, mut acceleration) = (body.axis, Twist::default());
                if i > j {
                    // All bodies of a branch but the first have their parent in it.
                    let parent = body.parent.unwrap_or(j);
                    unit = work.in_parent[i].twist_inside(&work.other_velocity[parent]);
                    acceleration = work.in_parent[i].twist_inside(&work.acceleration[parent]) + unit.cross(&(body.axis * (0.5 * rates[i])));
                } else {
                    acceleration = acceleration + work.velocity[i].cross(&(body.axis * 0.5));
                }
                let velocity = work.velocity[i];
                let turned = velocity.cross_force(&body.inertia.times(&unit)) + unit.cross_force(&body.inertia.times(&velocity));
                work.force[i] = body.inertia.times(&acceleration) + turned * 0.5;
                work.other_velocity[i] = unit;
                work.acceleration[i] = acceleration;
            }
            for i in 0..self.len() {
                matrix[(i, j)] = 0.0;
            }
            for i in (j..end).rev() {
                matrix[(i, j)] = self.bodies[i].axis.dot(&work.force[i]);
                if let (true, Some(parent)) = (i > j, self.bodies[i].parent) {
                    let force = work.in_parent[i].wrench_outside(&work.force[i]);
                    work.force[parent] += force;
                }
            }
            let (mut inner, mut force): (usize, Wrench) = (j, work.force[j]);
            while let Some(parent) = self.bodies[inner].parent {
                force = work.in_parent[inner].wrench_outside(&force);
                inner = parent;
                matrix[(inner, j)] = self.bodies[inner].axis.dot(&force);
            }
        }
    }
}
