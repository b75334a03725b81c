//! The kick of a substep: speeds change at fixed positions.
//!
//! With the speeds `v0` before and `v1` after, `v = (v0 + v1)/2`, the forces `F` that positions and inputs set, and the dry
//! friction `r` of every joint,
//!
//! `M (v1 - v0) = h (F - D v - G r)`, with `r` within its levels: at the upper one where the joint goes on forwards, at the lower one where it goes
//! on backwards. It is in between only where the joint comes to rest (its part of `v1` is 0).
//!
//! Levels and dampings that hang on speed are taken at v0, then once more at the v that this gives.

use super::dense::{self, add_between, pick};
use super::joint::Joint;

/// Rounds of the friction forces at most. They hang together only through inertia, so a few rounds do.
const ROUNDS: usize = 200;

/// Rounds end when no friction changes by more than this share of the largest level.
const SETTLED: f64 = 1e-13;

pub(super) struct Kick {
    /// kg, over all bodies.
    mass: Vec<f64>,
    bodies: usize,
    free: Vec<usize>,
    moved: Vec<bool>,
    h: f64,
    /// Dampings that the inverse and the compliance are of.
    dampings: Vec<f64>,
    /// Of `M + h D/2` over the free bodies.
    inverse: Vec<f64>,
    /// Joints with dry friction, their levels, their friction, and how a friction changes the speed of every such joint.
    dry: Vec<usize>,
    levels: Vec<[f64; 2]>,
    pub friction: Vec<f64>,
    compliance: Vec<f64>,
    before: Vec<f64>,
    mean: Vec<f64>,
    momentum: Vec<f64>,
    after: Vec<f64>,
    moved_speeds: Vec<f64>,
    free_speeds: Vec<f64>,
    /// Of `M` over the free bodies.
    mass_inverse: Vec<f64>,
}

impl Kick {
    pub fn new(mass: Vec<f64>, mass_inverse: Vec<f64>, free: Vec<usize>, joints: &[Joint], dry: usize, h: f64) -> Kick {
        let bodies = mass.len().isqrt();
        let mut moved = vec![true; bodies];
        free.iter().for_each(|body| moved[*body] = false);
        let mut kick = Kick {
            mass,
            bodies,
            moved,
            h,
            dampings: vec![f64::NAN; joints.len()],
            inverse: vec![0.0; free.len() * free.len()],
            dry: joints.iter().enumerate().filter(|(_, joint)| joint.dry.is_some()).map(|(index, _)| index).collect(),
            levels: vec![[0.0; 2]; dry],
            friction: vec![0.0; dry],
            compliance: vec![0.0; dry * dry],
            before: vec![0.0; bodies],
            mean: vec![0.0; bodies],
            momentum: vec![0.0; free.len()],
            after: vec![0.0; bodies],
            moved_speeds: vec![0.0; bodies],
            free_speeds: vec![0.0; dry],
            free,
            mass_inverse,
        };
        // A device without joints has no damping that could change.
        kick.factor(joints);
        kick
    }

    /// m/s, of a moved body at the end of this substep.
    pub fn set_moved_speed(&mut self, body: usize, speed: f64) {
        self.moved_speeds[body] = speed;
    }

    /// Carries the speeds over the substep. `forces` (N) are those of positions and inputs on every body.
    pub fn strike(&mut self, joints: &mut [Joint], memory: &mut [f64], positions: &[f64], speeds: &mut [f64], forces: &[f64]) {
        self.before.copy_from_slice(speeds);
        self.mean.copy_from_slice(speeds);
        let mut changed = self.take_speeds(joints, memory, positions);
        self.solve(joints, changed, forces);
        for body in 0..self.bodies {
            self.mean[body] = 0.5 * (self.before[body] + self.after[body]);
        }
        let levels_before = self.levels_sum();
        changed = self.take_speeds(joints, memory, positions);
        if changed || self.levels_sum() != levels_before {
            self.solve(joints, changed, forces);
        }
        for body in 0..self.bodies {
            self.mean[body] = 0.5 * (self.before[body] + self.after[body]);
        }
        for index in &self.dry {
            let joint = &joints[*index];
            let friction = joint.dry.map_or(0.0, |dry| self.friction[dry]);
            joint.force.after(friction, joint.relative(&self.mean), self.h, &mut memory[joint.memory.clone()]);
        }
        speeds.copy_from_slice(&self.after);
    }

    fn levels_sum(&self) -> f64 {
        self.levels.iter().map(|[positive, negative]| positive + negative).sum()
    }

    /// Dampings and levels at the mean speeds; whether a damping changed.
    fn take_speeds(&mut self, joints: &mut [Joint], memory: &[f64], positions: &[f64]) -> bool {
        let mut changed = false;
        for index in 0..joints.len() {
            let load: f64 = joints[index].loaded_by.iter().map(|(loading, sign)| sign * joints[*loading].path_force).sum();
            let joint = &mut joints[index];
            let (v, remembered) = (joint.relative(&self.mean), &memory[joint.memory.clone()]);
            joint.damping = joint.force.damping(joint.relative(positions), v, remembered);
            changed |= joint.damping != self.dampings[index];
            if let Some(dry) = joint.dry {
                self.levels[dry] = joint.force.dry(v, load, remembered);
            }
        }
        changed
    }

    fn solve(&mut self, joints: &[Joint], dampings_changed: bool, forces: &[f64]) {
        if dampings_changed {
            self.factor(joints);
        }
        let (n, all) = (self.free.len(), self.bodies);
        // M v0 + h (F - D v0/2), with what moved bodies bring along.
        for (row, &body) in self.free.iter().enumerate() {
            let mut sum = self.h * forces[body];
            for other in 0..all {
                let mass = self.mass[body * all + other];
                sum += if self.moved[other] { mass * (self.before[other] - self.moved_speeds[other]) } else { mass * self.before[other] };
            }
            self.momentum[row] = sum;
        }
        for joint in joints {
            // Half of the damping force at v0; of moved bodies also the half at v1, which is known.
            let later = |place: Option<usize>| place.map_or(0.0, |body| if self.moved[body] { self.moved_speeds[body] } else { 0.0 });
            let v = joint.relative(&self.before) + later(joint.between[0]) - later(joint.between[1]);
            let impulse = 0.5 * self.h * joint.damping * v;
            for (place, sign) in [(joint.between[0], -1.0), (joint.between[1], 1.0)] {
                if let Some(row) = place.and_then(|body| self.free.iter().position(|free| *free == body)) {
                    self.momentum[row] += sign * impulse;
                }
            }
        }
        self.after.copy_from_slice(&self.moved_speeds);
        for (row, &body) in self.free.iter().enumerate() {
            self.after[body] = (0..n).map(|k| self.inverse[row * n + k] * self.momentum[k]).sum();
        }
        self.rub(joints);
    }

    /// Finds the friction of every dry joint, one after the other until none changes (projected Gauss-Seidel), and what it
    /// does to the speeds.
    fn rub(&mut self, joints: &[Joint]) {
        let count = self.dry.len();
        if count == 0 {
            return;
        }
        for (dry, joint) in self.dry.iter().enumerate() {
            self.free_speeds[dry] = joints[*joint].relative(&self.after);
        }
        let largest = self.levels.iter().flatten().fold(0.0, |most: f64, level| most.max(*level));
        for _ in 0..ROUNDS {
            let mut change = 0.0_f64;
            for i in 0..count {
                let speed: f64 = self.free_speeds[i] - (0..count).map(|k| self.compliance[i * count + k] * self.friction[k]).sum::<f64>();
                let own = self.compliance[i * count + i];
                let [forwards, backwards] = self.levels[i];
                let wanted = if own > 0.0 {
                    self.friction[i] + speed / own
                } else {
                    // Nothing yields: both ends are moved or ground.
                    f64::INFINITY.copysign(speed) * f64::from(u8::from(speed != 0.0))
                };
                let wanted = if wanted.is_nan() { 0.0 } else { wanted.clamp(-backwards, forwards) };
                change = change.max((wanted - self.friction[i]).abs());
                self.friction[i] = wanted;
            }
            if change <= SETTLED * largest {
                break;
            }
        }
        let n = self.free.len();
        self.momentum.fill(0.0);
        for (dry, joint) in self.dry.iter().enumerate() {
            for (place, sign) in [(joints[*joint].between[0], -1.0), (joints[*joint].between[1], 1.0)] {
                if let Some(row) = place.and_then(|body| self.free.iter().position(|free| *free == body)) {
                    self.momentum[row] += sign * self.h * self.friction[dry];
                }
            }
        }
        for (row, &body) in self.free.iter().enumerate() {
            self.after[body] += (0..n).map(|k| self.inverse[row * n + k] * self.momentum[k]).sum::<f64>();
        }
    }

    /// Inverse and compliance for the dampings of this substep.
    fn factor(&mut self, joints: &[Joint]) {
        let (n, all) = (self.free.len(), self.bodies);
        let mut full = self.mass.clone();
        for (index, joint) in joints.iter().enumerate() {
            self.dampings[index] = joint.damping;
            add_between(&mut full, all, joint.between, 0.5 * self.h * joint.damping);
        }
        match dense::inverse(&pick(&full, all, &self.free), n) {
            Some(inverse) => self.inverse = inverse,
            // Only a negative damping as large as the inertia does this. The speeds show it: they are no numbers then.
            None => self.inverse.fill(f64::NAN),
        }
        let count = self.dry.len();
        let row = |place: Option<usize>| place.and_then(|body| self.free.iter().position(|free| *free == body));
        let rows: Vec<[Option<usize>; 2]> = self.dry.iter().map(|joint| joints[*joint].between.map(row)).collect();
        for i in 0..count {
            for k in 0..count {
                let mut sum = 0.0;
                for (a, sign_a) in [(rows[i][0], 1.0), (rows[i][1], -1.0)] {
                    for (b, sign_b) in [(rows[k][0], 1.0), (rows[k][1], -1.0)] {
                        if let (Some(a), Some(b)) = (a, b) {
                            sum += sign_a * sign_b * self.inverse[a * n + b];
                        }
                    }
                }
                self.compliance[i * count + k] = self.h * sum;
            }
        }
    }

    /// Accelerations (m/s2) of the free bodies under the `forces` (N) on every body and those of the moved ones, which are
    /// there already; and what the movers exert (N).
    pub fn accelerate(&self, forces: &[f64], accelerations: &mut [f64], reactions: &mut [f64]) {
        let (n, all) = (self.free.len(), self.bodies);
        let carried = |body: usize, accelerations: &[f64]| -> f64 {
            (0..all).filter(|other| self.moved[*other]).map(|other| self.mass[body * all + other] * accelerations[other]).sum()
        };
        for (row, &body) in self.free.iter().enumerate() {
            accelerations[body] =
                (0..n).map(|k| self.mass_inverse[row * n + k] * (forces[self.free[k]] - carried(self.free[k], accelerations))).sum();
        }
        for body in (0..all).filter(|body| self.moved[*body]) {
            reactions[body] = (0..all).map(|other| self.mass[body * all + other] * accelerations[other]).sum::<f64>() - forces[body];
        }
    }
}
