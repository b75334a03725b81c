//! What is known of a joint before any fit: torque of elements that the regression has no terms for, whether it has a motor, and what its torque is compared
//! with.

use crate::arms::physics::AtJoints;
use crate::arms::regression::{Data, parts_of};
use crate::arms::stated::{self, Stated, Unused};
use backdrive_signal::statistics::rms;

impl Data<'_> {
    /// Elements whose torque is computed along the motion: those between two joints, and those whose law the regression has no terms for.
    fn elements_along(&self) -> Vec<Stated> {
        let on_one = self.problem.given.iter().filter(|given| parts_of(&given.law).is_empty());
        let on_one = on_one.map(|g| Stated { name: g.name.clone(), ends: vec![(g.joint, g.sign)], law: g.law.clone() });
        self.problem.stated.iter().cloned().chain(on_one).collect()
    }

    /// A sentence for each element that counts with the parameters of the file.
    pub(crate) fn notes_along(&self) -> Vec<String> {
        let used = self.elements_along().into_iter().filter(|one| !self.unused.iter().any(|unused| unused.name == one.name));
        let say = |one: Stated| {
            let kind = one.law.kind().name;
            format!(
                "\"{}\" ({kind}) is computed along the measured motion with the parameters of the file; they are not refitted",
                one.name
            )
        };
        used.map(say).collect()
    }

    /// Torque of elements that have no term, by motion, and elements for which it cannot be computed.
    pub(crate) fn stated(&self) -> (Vec<AtJoints>, Vec<Unused>) {
        let mut along: Vec<AtJoints> = vec![Vec::new(); self.motions.len()];
        let mut unused = Vec::new();
        let pose = self.problem.model.arm.as_ref().map_or(&[][..], |arm| arm.pose.as_slice());
        for one in self.elements_along() {
            let of_motion = |motion| stated::torque(&one, motion, pose, self.rates.period());
            match self.motions.iter().map(of_motion).collect::<Result<Vec<_>, String>>() {
                Ok(torques) => {
                    for (signals, torque) in along.iter_mut().zip(&torques) {
                        signals.extend(one.ends.iter().map(|(joint, sign)| (*joint, torque.iter().map(|x| sign * x).collect())));
                    }
                }
                Err(why) => unused.push(Unused { name: one.name.clone(), kind: one.law.kind().name.to_string(), why }),
            }
        }
        (along, unused)
    }

    /// What moves a joint without a motor: the rms torque of gravity or of its own inertia, whichever is more, N m or N.
    pub(crate) fn passive_scale(&self, joint: usize) -> f64 {
        let by_gravity = self.by_tilt.iter().filter_map(|tilt| tilt.last());
        let gravity = rms(by_gravity.flat_map(|signals| signals[joint].iter().copied()));
        let inertia =
            self.inertia.iter().zip(&self.motions).flat_map(|(i, m)| i[joint].iter().zip(&m.acceleration[joint]).map(|(i, a)| i * a));
        gravity.max(rms(inertia))
    }

    /// The reference of a joint's torque: its rms over the logs for fitting (or those held out), in N m or N (prismatic).
    /// A joint without a motor has none, and its equation is compared with the torque of gravity or of its inertia.
    pub fn scale(&self, joint: usize, held_out: bool) -> f64 {
        self.passive[joint].unwrap_or_else(|| self.mean_square(&self.torque, joint, held_out).sqrt())
    }

    /// Whether a joint has no motor.
    pub fn is_passive(&self, joint: usize) -> bool {
        self.passive[joint].is_some()
    }

    /// By how much a joint's torque counts less: one without its sign next to nothing.
    pub(crate) fn doubt(&self, joint: usize) -> f64 {
        if self.unsigned[joint] { 1e3 } else { 1.0 }
    }
}
