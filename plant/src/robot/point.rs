//! Points of links: where a hand, a motor force or a wall acts on an arm, and how that place moves with the joints.

use super::spatial::Twist;
use super::tree::{Tree, Workspace};
use nalgebra::Vector3;

/// A point of a link, seen along one direction: a body of the network without inertia, whose displacement is how far the point has come along `axis` since
/// the pose. A force F on it is `Jᵀ F` on the joints, J being the row of the point's Jacobian at the arm's present coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Body of the network that it is.
    pub body: usize,
    /// Index of the link in [`super::Robot::links`].
    pub link: usize,
    /// In the link's frame, m.
    pub at: Vector3<f64>,
    /// Unit vector in the base's frame, which does not turn with the link.
    pub axis: Vector3<f64>,
}

/// How points move: displacement, its derivative by each coordinate, and its acceleration while no rate changes.
impl Tree {
    /// How far along `axis` from the base's origin a point is, m, as the bodies were placed last.
    pub fn distance_here(&self, point: &Point, work: &Workspace) -> f64 {
        self.link_placement(point.link, work).map_or(0.0, |link| point.axis.dot(&link.point(&point.at)))
    }

    /// Its derivative by each coordinate, m/rad or 1, as the bodies were placed last. `columns` is space for as many twists as there are coordinates.
    pub fn gradient_here(&self, point: &Point, work: &Workspace, columns: &mut [Twist], row: &mut [f64]) {
        self.jacobian(point.link, &point.at, work, columns);
        for (value, column) in row.iter_mut().zip(&*columns) {
            *value = point.axis.dot(&column.linear);
        }
    }

    /// `J̇ v`: acceleration along `axis` of a point while the joints go on at the rates they have, m/s², as the bodies move since
    /// [`Tree::velocities`]. With z_k, o_k axis and place of joint k and p the point, seen from the base, it is a sum over pairs of joints of the
    /// chain. Each pair adds `z_i × (z_k × (p - o_k)) v_i v_k`, i being the one nearer the base.
    pub(crate) fn drift_here(&self, point: &Point, rates: &[f64], work: &Workspace, columns: &mut [Twist]) -> f64 {
        self.jacobian(point.link, &point.at, work, columns);
        let mut drift = Vector3::zeros();
        let Some((Some(last), _)) = self.links.get(point.link) else { return 0.0 };
        let mut outer = Some(*last);
        while let Some(k) = outer {
            let moved = columns[k].linear * rates[k];
            let mut inner = Some(k);
            while let Some(i) = inner {
                // A pair of different joints counts twice; one that slides turns nothing.
                let times = if i == k { 1.0 } else { 2.0 };
                drift += columns[i].angular.cross(&moved) * (rates[i] * times);
                inner = self.bodies[i].parent;
            }
            outer = self.bodies[k].parent;
        }
        point.axis.dot(&drift)
    }
}
