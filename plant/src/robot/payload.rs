//! A known mass that an arm carries, such as a weight screwed to its flange for one log.

use super::arm::Arm;
use super::description::{LinkInertia, Robot};
use super::error::RobotError;
use super::tree::Tree;
use nalgebra::{Matrix3, Vector3};

/// A mass at a point of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Payload {
    /// kg.
    pub mass: f64,
    /// Where its centre is in the frame of the link, m.
    pub at: Vector3<f64>,
    /// The link that carries it; `None` for that of the last joint that moves.
    pub link: Option<String>,
}

impl Robot {
    /// The robot with an additional point mass on one of its links, by index; a link that is not there leaves it unchanged.
    pub fn with_mass_at(&self, link: usize, mass: f64, at: Vector3<f64>) -> Robot {
        let mut out = self.clone();
        let Some(link) = out.links.get_mut(link) else { return out };
        let own = link.inertia.unwrap_or(LinkInertia { mass: 0.0, centre: Vector3::zeros(), about_centre: Matrix3::zeros() });
        let all = own.mass + mass;
        let centre = if all > 0.0 { (own.centre * own.mass + at * mass) / all } else { own.centre };
        // About the common centre of mass (Steiner).
        let moved = |m: f64, from: Vector3<f64>| {
            let c = (from - centre).cross_matrix();
            -m * (c * c)
        };
        link.inertia =
            Some(LinkInertia { mass: all, centre, about_centre: own.about_centre + moved(own.mass, own.centre) + moved(mass, at) });
        out
    }
}

impl Arm {
    /// Index of the link that carries a payload.
    ///
    /// # Errors
    /// A sentence, where the robot has no such link, or it does not move.
    pub fn link_of(&self, payload: &Payload) -> Result<usize, String> {
        let carried = |link: usize| self.robot.joints.iter().find(|joint| joint.child == link);
        let Some(name) = &payload.link else {
            let last = self.tree.coordinates().last().and_then(|c| self.robot.joints.get(c.joint));
            return last.map(|joint| joint.child).ok_or_else(|| "the robot has no joint that moves".to_string());
        };
        let names = || self.robot.links.iter().map(|l| l.name.as_str()).collect::<Vec<_>>().join(", ");
        let link = self.robot.link(name).ok_or_else(|| format!("the robot has no link \"{name}\"; it has {}", names()))?;
        let mut at = link;
        // A robot is a tree: no more steps than links.
        for _ in 0..self.robot.links.len() {
            let Some(joint) = carried(at) else { break };
            if joint.kind != super::JointKind::Fixed {
                return Ok(link);
            }
            at = joint.parent;
        }
        Err(format!("link \"{name}\" is part of the base, which does not move"))
    }

    /// The arm with a payload on it.
    ///
    /// # Errors
    /// Where the robot cannot be computed with it. A link that is not there leaves it unchanged ([`Arm::link_of`] finds links).
    pub fn carrying(&self, payload: &Payload) -> Result<Arm, RobotError> {
        let Ok(link) = self.link_of(payload) else { return Ok(self.clone()) };
        let robot = self.robot.with_mass_at(link, payload.mass, payload.at);
        let mut tree = Tree::new(&robot)?;
        (0..tree.len()).for_each(|i| tree.set_armature(i, 0.0));
        Ok(Arm { robot, tree, ..self.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Inertia;

    #[test]
    fn a_point_mass_adds_its_moments_about_the_links_origin() {
        let own = LinkInertia {
            mass: 2.0,
            centre: Vector3::new(0.1, -0.2, 0.05),
            about_centre: Matrix3::new(0.03, 0.001, 0.0, 0.001, 0.02, -0.002, 0.0, -0.002, 0.04),
        };
        let mut robot = Robot::default();
        robot.links.push(crate::robot::Link { name: "one".to_string(), inertia: Some(own) });
        let at = Vector3::new(0.3, 0.4, -0.1);
        let heavy = robot.with_mass_at(0, 0.7, at).links[0].inertia.unwrap();
        let of = |i: &LinkInertia| Inertia::new(i.mass, i.centre, i.about_centre);
        let (before, after) = (of(&own), of(&heavy));
        let c = at.cross_matrix();
        assert!((after.first_moment - before.first_moment - at * 0.7).norm() < 1e-14);
        assert!((after.rotational - before.rotational + 0.7 * c * c).norm() < 1e-14);
        assert!((after.mass - 2.7).abs() < 1e-15);
    }
}
