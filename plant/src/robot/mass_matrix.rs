//! The mass matrix: the composite-rigid-body algorithm (RBDA, table 6.2).

use super::tree::{Tree, Workspace};
use nalgebra::DMatrix;

impl Tree {
    /// M(q), the whole symmetric matrix, kg m², kg m or kg; armatures are on its diagonal. `matrix` has a row and a column for each coordinate.
    pub fn mass_matrix(&self, coordinates: &[f64], work: &mut Workspace, matrix: &mut DMatrix<f64>) {
        self.place(coordinates, work);
        self.mass_matrix_here(work, matrix);
    }

    /// The same of the bodies where they are.
    pub(crate) fn mass_matrix_here(&self, work: &mut Workspace, matrix: &mut DMatrix<f64>) {
        for (i, body) in self.bodies.iter().enumerate() {
            work.composite[i] = body.inertia;
        }
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let composite = work.composite[i];
            if let Some(parent) = body.parent {
                let seen = composite.outside(&work.in_parent[i]);
                work.composite[parent] += seen;
            }
            let mut force = composite.times(&body.axis);
            matrix[(i, i)] = body.axis.dot(&force) + body.armature;
            // Coordinates of other branches do not feel it.
            for j in 0..i {
                (matrix[(i, j)], matrix[(j, i)]) = (0.0, 0.0);
            }
            let mut inner = i;
            while let Some(parent) = self.bodies[inner].parent {
                force = work.in_parent[inner].wrench_outside(&force);
                inner = parent;
                let value = self.bodies[inner].axis.dot(&force);
                (matrix[(i, inner)], matrix[(inner, i)]) = (value, value);
            }
        }
    }
}
