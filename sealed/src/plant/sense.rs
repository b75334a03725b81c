//! What is measured at the end of a period.

use super::state::SealedPlant;
use crate::laws::Path;
use crate::network::OutputKind;

impl SealedPlant {
    /// Forces and accelerations at the end of the period, then every output.
    pub(super) fn measure(&mut self) {
        self.scratch.copy_from_slice(&self.memory);
        self.applied.fill(0.0);
        for drive in &mut self.drives {
            let body = drive.body();
            if drive.is_motion() {
                self.accelerations[body] = drive.acceleration(1.0 / self.substeps as f64);
            } else {
                self.applied[body] += drive.force_now();
            }
        }
        for (index, joint) in self.joints.iter().enumerate() {
            // Half a substep has gone by since the memories were carried on. Friction is that of the last kick.
            let x = joint.relative(&self.positions);
            let v = joint.relative(&self.speeds);
            let path = Path { from: joint.last, to: x, speed: v, duration: 0.5 * self.substep_s };
            let remembered = &mut self.scratch[joint.memory.clone()];
            let along = joint.force.path_force(&path, remembered);
            let friction = joint.dry.map_or(0.0, |dry| self.kick.friction[dry]);
            let force = along + joint.force.damping(x, v, remembered) * v + friction;
            joint.push(force, &mut self.applied);
            self.element_forces[index] = force;
        }
        self.kick.accelerate(&self.applied, &mut self.accelerations, &mut self.reactions);
        for (index, joint) in self.joints.iter().enumerate() {
            let inertance = joint.force.inertance();
            if inertance > 0.0 {
                self.element_forces[index] += inertance * joint.relative(&self.accelerations);
            }
        }
        for (index, sensor) in self.sensors.iter_mut().enumerate() {
            let value = match &sensor.output.kind {
                OutputKind::Position(body) => self.positions[*body],
                OutputKind::Velocity(body) => self.speeds[*body],
                OutputKind::Acceleration(body) => self.accelerations[*body],
                OutputKind::Force(elements) => elements.iter().map(|element| self.element_forces[*element]).sum(),
                OutputKind::Reaction(body) => self.reactions[*body],
            };
            (self.exact[index], self.measured[index]) = sensor.read(value);
        }
    }
}
