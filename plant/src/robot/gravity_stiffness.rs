//! How gravity pulls harder or less when a robot is moved a little.

use super::spatial::Twist;
use super::tree::{Tree, Workspace};
use nalgebra::{DMatrix, Vector3};

impl Tree {
    /// `dg/dq`, symmetric, N m/rad and the like: by how much the forces that hold the robot still change with its coordinates. Turning a branch is, seen from
    /// it, turning gravity the other way.
    pub fn gravity_stiffness(&self, coordinates: &[f64], work: &mut Workspace, matrix: &mut DMatrix<f64>) {
        self.place(coordinates, work);
        let lift = Twist { angular: Vector3::zeros(), linear: -self.gravity };
        for (i, body) in self.bodies.iter().enumerate() {
            let outside = body.parent.map_or(lift, |parent| work.acceleration[parent]);
            work.acceleration[i] = work.in_parent[i].twist_inside(&outside);
            work.composite[i] = body.inertia;
        }
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let composite = work.composite[i];
            if let Some(parent) = body.parent {
                let seen = composite.outside(&work.in_parent[i]);
                work.composite[parent] += seen;
            }
            for j in 0..i {
                (matrix[(i, j)], matrix[(j, i)]) = (0.0, 0.0);
            }
            let mut force = composite.times(&body.axis);
            matrix[(i, i)] = work.acceleration[i].cross(&body.axis).dot(&force);
            let mut inner = i;
            while let Some(parent) = self.bodies[inner].parent {
                force = work.in_parent[inner].wrench_outside(&force);
                inner = parent;
                let value = work.acceleration[inner].cross(&self.bodies[inner].axis).dot(&force);
                (matrix[(i, inner)], matrix[(inner, i)]) = (value, value);
            }
        }
    }
}
