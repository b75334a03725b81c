//! Where the links are, and how they move with the coordinates.

use super::spatial::{Placement, Twist};
use super::tree::{Tree, Workspace};
use nalgebra::Vector3;

impl Tree {
    /// Puts the bodies where the coordinates say; rad and m.
    ///
    /// # Panics
    /// Here and below: where a slice has fewer numbers than the tree has coordinates, or the workspace is another tree's.
    #[inline]
    pub fn place(&self, coordinates: &[f64], work: &mut Workspace) {
        for (i, body) in self.bodies.iter().enumerate() {
            let here = body.in_parent(coordinates[i]);
            work.in_parent[i] = here;
            work.in_base[i] = body.parent.map_or(here, |parent| work.in_base[parent].then(&here));
        }
    }

    /// Where a link is, seen from the base, as the bodies were placed last. `None` when there is no such link.
    pub fn link_placement(&self, link: usize, work: &Workspace) -> Option<Placement> {
        let (body, inside) = self.links.get(link)?;
        Some(body.map_or(*inside, |body| work.in_base[body].then(inside)))
    }

    /// How a point of a link moves, in the last placement of the bodies. For each coordinate it holds the velocity of the point and the turning of the link
    /// per unit of its rate, along the axes of the base. `point` is in the link's frame, m. Coordinates that do not move the link have 0; so have all where
    /// there is no such link.
    pub fn jacobian(&self, link: usize, point: &Vector3<f64>, work: &Workspace, columns: &mut [Twist]) {
        columns[..self.len()].fill(Twist::default());
        let Some((Some(body), inside)) = self.links.get(link) else { return };
        let tip = work.in_base[*body].point(&inside.point(point));
        let mut next = Some(*body);
        while let Some(i) = next {
            let at_origin = work.in_base[i].twist_outside(&self.bodies[i].axis);
            columns[i] = Twist { angular: at_origin.angular, linear: at_origin.linear + at_origin.angular.cross(&tip) };
            next = self.bodies[i].parent;
        }
    }

    /// Places the bodies, and moves them at these rates; what follows and ends on `_here` is about them as they move then.
    #[inline]
    pub(crate) fn velocities(&self, coordinates: &[f64], rates: &[f64], work: &mut Workspace) {
        self.place(coordinates, work);
        for (i, body) in self.bodies.iter().enumerate() {
            let carried = body.parent.map_or_else(Twist::default, |parent| work.in_parent[i].twist_inside(&work.velocity[parent]));
            work.velocity[i] = carried + body.axis * rates[i];
        }
    }
}
