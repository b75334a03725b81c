//! What a robot has to be: one tree, with inertias that a body can have.

use super::description::{Joint, JointKind, Link, Robot};
use super::error::{Part, RobotError};
use nalgebra::Matrix3;

/// Rounding of printed numbers that counts as none, as a share of the largest.
const ROUNDING: f64 = 1e-5;

impl Robot {
    /// The error about a link.
    pub(super) fn fault_of_link(&self, link: usize, message: impl Into<String>) -> RobotError {
        let name = self.links.get(link).map_or("?", |link| link.name.as_str());
        RobotError { part: Part::Link(link), place: format!("link \"{name}\""), message: message.into() }
    }

    /// The error about a joint.
    pub(super) fn fault_of_joint(&self, joint: usize, message: impl Into<String>) -> RobotError {
        let name = self.joints.get(joint).map_or("?", |joint| joint.name.as_str());
        RobotError { part: Part::Joint(joint), place: format!("joint \"{name}\""), message: message.into() }
    }

    /// Joints in the order of the tree, from the base outwards, each before what it carries.
    ///
    /// # Errors
    /// Where the links are no tree from the first one on, or a number is none that a body can have.
    pub(super) fn check(&self) -> Result<Vec<usize>, RobotError> {
        if self.links.is_empty() {
            let message = "has no links; a robot has at least its base".to_owned();
            return Err(RobotError { part: Part::Robot, place: format!("robot \"{}\"", self.name), message });
        }
        if !self.gravity.iter().all(|g| g.is_finite()) {
            let message = "gravity must be three finite numbers, m/s²".to_owned();
            return Err(RobotError { part: Part::Robot, place: format!("robot \"{}\"", self.name), message });
        }
        for (index, link) in self.links.iter().enumerate() {
            link.check().map_err(|message| self.fault_of_link(index, message))?;
        }
        for (index, joint) in self.joints.iter().enumerate() {
            joint.check(self.links.len()).map_err(|message| self.fault_of_joint(index, message))?;
        }
        self.order()
    }

    fn order(&self) -> Result<Vec<usize>, RobotError> {
        let mut carrier: Vec<Option<usize>> = vec![None; self.links.len()];
        for (index, joint) in self.joints.iter().enumerate() {
            if joint.child == 0 {
                let message = format!("carries the base \"{}\", which does not move; turn the joint round", self.links[0].name);
                return Err(self.fault_of_joint(index, message));
            }
            if let Some(first) = carrier[joint.child].replace(index) {
                let message = format!(
                    "link \"{}\" is carried by joint \"{}\" already: the links form a loop, and a tree is expected; leave one of the two joints out",
                    self.links[joint.child].name, self.joints[first].name
                );
                return Err(self.fault_of_joint(index, message));
            }
        }
        let mut carried: Vec<Vec<usize>> = vec![Vec::new(); self.links.len()];
        for (index, joint) in self.joints.iter().enumerate() {
            carried[joint.parent].push(index);
        }
        let mut order = Vec::with_capacity(self.joints.len());
        let mut reached = vec![false; self.links.len()];
        reached[0] = true;
        let mut open: Vec<usize> = carried[0].iter().rev().copied().collect();
        while let Some(joint) = open.pop() {
            order.push(joint);
            reached[self.joints[joint].child] = true;
            open.extend(carried[self.joints[joint].child].iter().rev());
        }
        match reached.iter().position(|reached| !reached) {
            None => Ok(order),
            Some(link) if carrier[link].is_none() => {
                let message = format!("no joint carries it; join it to a link that hangs on the base \"{}\"", self.links[0].name);
                Err(self.fault_of_link(link, message))
            }
            Some(link) => {
                let base = &self.links[0].name;
                let message = format!(
                    "following its joints inwards never comes to the base \"{base}\": the links form a loop; leave one joint of it out"
                );
                Err(self.fault_of_link(link, message))
            }
        }
    }
}

impl Link {
    fn check(&self) -> Result<(), String> {
        let Some(inertia) = &self.inertia else { return Ok(()) };
        if !(inertia.mass.is_finite() && inertia.mass >= 0.0) {
            return Err(format!("mass must be at least 0 kg and finite, is {}", inertia.mass));
        }
        if !inertia.centre.iter().chain(inertia.about_centre.iter()).all(|value| value.is_finite()) {
            return Err("centre of mass and inertia must be finite numbers".to_owned());
        }
        let largest = inertia.about_centre.amax();
        if (inertia.about_centre - inertia.about_centre.transpose()).amax() > 1e-12 * largest {
            return Err("the matrix of inertia must be symmetric".to_owned());
        }
        let principal = principal_moments(&inertia.about_centre);
        if principal[0] < -ROUNDING * principal[2].abs() {
            return Err(format!(
                "the matrix of inertia has the principal moments {:.4e}, {:.4e} and {:.4e} kg m², and none may be below 0; check its signs",
                principal[0], principal[1], principal[2]
            ));
        }
        Ok(())
    }

    /// A remark where no body could have this inertia although it can be computed with: of three principal moments none is more than the two others.
    pub fn doubt(&self) -> Option<String> {
        let [a, b, c] = principal_moments(&self.inertia.as_ref()?.about_centre);
        (c > (a + b) * (1.0 + ROUNDING)).then(|| {
            format!(
                "has the principal moments {a:.4e}, {b:.4e} and {c:.4e} kg m²: no body has one that is more than the two others together"
            )
        })
    }
}

/// Eigenvalues, smallest first.
fn principal_moments(inertia: &Matrix3<f64>) -> [f64; 3] {
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments
}

impl Joint {
    fn check(&self, links: usize) -> Result<(), String> {
        if self.parent >= links || self.child >= links {
            return Err("names a link that the robot does not have".to_owned());
        }
        if self.parent == self.child {
            return Err("joins a link to itself".to_owned());
        }
        let rotation = &self.origin.rotation;
        let finite = self.origin.translation.iter().chain(rotation.iter()).all(|value| value.is_finite());
        if !finite || (rotation.transpose() * rotation - Matrix3::identity()).amax() > 1e-9 {
            return Err("its place in the parent must be a rotation and a finite shift".to_owned());
        }
        let is_unit = self.axis.iter().all(|x| x.is_finite()) && (self.axis.norm() - 1.0).abs() <= 1e-9;
        if self.kind != JointKind::Fixed && !is_unit {
            return Err(format!("its axis must be a vector of length 1, is ({}, {}, {})", self.axis.x, self.axis.y, self.axis.z));
        }
        for (what, value) in
            [("armature", self.armature), ("damping", self.damping), ("friction", self.friction), ("stiffness", self.stiffness)]
        {
            if !(value.is_finite() && value >= 0.0) {
                return Err(format!("{what} must be at least 0 and finite, is {value}"));
            }
        }
        if !(self.reference.is_finite() && self.rest.is_finite()) {
            return Err("its reference and the rest of its spring must be finite numbers".to_owned());
        }
        Ok(())
    }
}
