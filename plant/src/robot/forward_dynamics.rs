//! What motion a force makes: the articulated-body algorithm (RBDA, table 7.1).

use super::articulated::ArticulatedInertia;
use super::spatial::Twist;
use super::tree::{Tree, Workspace};
use nalgebra::Vector3;

impl Tree {
    /// Accelerations under these forces of the joints, rad/s² or m/s².
    pub fn forward_dynamics(&self, coordinates: &[f64], rates: &[f64], forces: &[f64], work: &mut Workspace, accelerations: &mut [f64]) {
        self.velocities(coordinates, rates, work);
        for (i, body) in self.bodies.iter().enumerate() {
            let velocity = work.velocity[i];
            work.acceleration[i] = velocity.cross(&(body.axis * rates[i]));
            work.articulated[i] = ArticulatedInertia::of(&body.inertia);
            work.force[i] = velocity.cross_force(&body.inertia.times(&velocity));
        }
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let mut felt = work.articulated[i];
            let resistance = felt.times(&body.axis);
            let give = body.axis.dot(&resistance) + body.armature;
            let surplus = forces[i] - body.axis.dot(&work.force[i]);
            (work.resistance[i], work.give[i], work.surplus[i]) = (resistance, give, surplus);
            if let Some(parent) = body.parent {
                felt.give_way(&resistance, give);
                let force = work.force[i] + felt.times(&work.acceleration[i]) + resistance * (surplus / give);
                work.articulated[parent] += felt.outside(&work.in_parent[i]);
                work.force[parent] += work.in_parent[i].wrench_outside(&force);
            }
        }
        // As if the base were lifted against gravity.
        let lift = Twist { angular: Vector3::zeros(), linear: -self.gravity };
        for (i, body) in self.bodies.iter().enumerate() {
            let outside = body.parent.map_or(lift, |parent| work.acceleration[parent]);
            let carried = work.in_parent[i].twist_inside(&outside) + work.acceleration[i];
            accelerations[i] = (work.surplus[i] - carried.dot(&work.resistance[i])) / work.give[i];
            work.acceleration[i] = carried + body.axis * accelerations[i];
        }
    }
}
