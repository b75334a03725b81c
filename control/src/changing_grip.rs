//! A master whose hand changes its grip while it holds.
//!
//! The law: a hand that tightens or loosens does so where it is. At the change the handle's position and velocity and the force of the hand's spring do
//! not change. From then on the force follows with the new stiffness, `dF = k' d(x_hand - x)`: the point that the spring pulls to moves along, by
//! `(k/k' - 1) (x_hand - x)`. So no force jumps; the spring's energy `F^2 / 2k` becomes `F^2 / 2k'`, and the difference is what the muscle gives or takes
//! ([`ChangingGrip::muscle_work`]).

use crate::device::{Device, DeviceError, DeviceOptions, DeviceRole};
use crate::mechanism::Mechanism;
use backdrive_msgs::MAX_AXES;
use backdrive_plant::elements::Role;
use backdrive_plant::model::{Axis, Fragment, Model};
use backdrive_plant::stepper::Plant;

/// A change of the grip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripChange {
    /// When, s from the start.
    pub at_s: f64,
    /// Factor on stiffness and damping of the grip of the file, from then on.
    pub scale: f64,
}

/// A device with the grips that it will have.
pub struct ChangingGrip {
    device: Device,
    /// Step at which each change comes, its factor, and the network from then on.
    changes: Vec<(u64, f64, Plant)>,
    done: usize,
    step: u64,
    scale: f64,
    shift: [f64; MAX_AXES],
    hand: [f64; MAX_AXES],
    muscle_work: f64,
}

impl ChangingGrip {
    /// A device as [`Device::new`] makes it of a master, its grip changed at `changes`, times ascending.
    ///
    /// # Errors
    /// [`DeviceError::NoHand`] where no grip of springs and dampers holds the model; else as [`Device::new`].
    pub fn new(
        model: &Model,
        grip: Option<&Fragment>,
        changes: &[GripChange],
        period_s: f64,
        options: &DeviceOptions,
    ) -> Result<ChangingGrip, DeviceError> {
        let linear = |f: &&Fragment| !f.network.elements.is_empty() && f.network.elements.iter().all(|e| is_linear(e.law.role()));
        let holds = model.axes.iter().any(|axis| !axis.holds_user);
        let grip = grip.filter(|_| holds).filter(linear).ok_or_else(|| DeviceError::NoSpringyHand(model.name.clone()))?;
        let held = |scale: f64, substeps: Option<usize>| {
            let mut grip = grip.clone();
            grip.scale(scale);
            Device::new(model, Some(&grip), DeviceRole::Master, period_s, &DeviceOptions { substeps, ..options.clone() })
        };
        // The firmest grip may need the most substeps; all take as many.
        let firmest = changes.iter().fold(1.0_f64, |most, change| most.max(change.scale));
        let substeps = Some(held(firmest, options.substeps)?.plant().substeps());
        let of = |change: &GripChange| {
            let at = (change.at_s / period_s).round().max(0.0) as u64;
            Ok((at, change.scale, held(change.scale, substeps)?.plant().clone()))
        };
        let changes = changes.iter().map(of).collect::<Result<Vec<_>, DeviceError>>()?;
        let (shift, hand) = ([0.0; MAX_AXES], [0.0; MAX_AXES]);
        Ok(ChangingGrip { device: held(1.0, substeps)?, changes, done: 0, step: 0, scale: 1.0, shift, hand, muscle_work: 0.0 })
    }

    /// What the muscle gave to the hand's springs at all changes so far, J; below 0 where it took more.
    pub fn muscle_work(&self) -> f64 {
        self.muscle_work
    }

    fn change(&mut self) {
        while let Some((at, scale, plant)) = self.changes.get_mut(self.done).filter(|(at, ..)| *at <= self.step) {
            debug_assert!(*at <= self.step);
            let stretches = self.scale / *scale - 1.0;
            for axis in 0..self.device.axes().min(MAX_AXES) {
                let stretch = self.hand[axis] + self.shift[axis] - self.device.user_position(axis);
                let before = self.scale * self.device.spring_energy(axis, stretch);
                self.shift[axis] += stretches * stretch;
                self.device.move_hand(axis, self.hand[axis] + self.shift[axis]);
                // F^2 / 2k: as the stiffness grows by a factor, the energy falls by it.
                self.muscle_work += stretches * before;
            }
            self.device.exchange_laws(plant);
            self.scale = *scale;
            self.done += 1;
        }
    }

    fn shifted(&mut self, hand: &[f64]) -> [f64; MAX_AXES] {
        let mut at = [0.0; MAX_AXES];
        for (axis, at) in at.iter_mut().enumerate() {
            self.hand[axis] = hand.get(axis).copied().unwrap_or(0.0);
            *at = self.hand[axis] + self.shift[axis];
        }
        at
    }
}

fn is_linear(role: Role) -> bool {
    matches!(role, Role::Linear(_))
}

impl Mechanism for ChangingGrip {
    fn axes(&self) -> usize {
        self.device.axes()
    }

    fn axis(&self, axis: usize) -> &Axis {
        self.device.axis(axis)
    }

    fn start(&mut self, force: &[f64], hand: &[f64]) {
        let hand = self.shifted(hand);
        self.device.start(force, &hand);
        self.change();
    }

    fn step(&mut self, force: &[f64], hand: &[f64]) {
        let hand = self.shifted(hand);
        self.device.step(force, &hand);
        self.step += 1;
        self.change();
    }

    fn measured(&self, axis: usize) -> f64 {
        self.device.measured(axis)
    }

    fn user_position(&self, axis: usize) -> f64 {
        self.device.user_position(axis)
    }

    fn user_velocity(&self, axis: usize) -> f64 {
        self.device.user_velocity(axis)
    }

    fn port_force(&self, axis: usize) -> f64 {
        self.device.port_force(axis)
    }

    fn is_finite(&self) -> bool {
        self.device.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1.0 / 5000.0;
    const STIFFNESS: f64 = 400.0;

    fn held(changes: &[GripChange]) -> ChangingGrip {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant");
        let read = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap();
        let model = Model::from_toml(&read("models/rigid-mass.toml"), "rigid-mass.toml").unwrap();
        let grip = Fragment::from_toml(&read("grips/normal.toml"), "normal.toml").unwrap();
        ChangingGrip::new(&model, Some(&grip), changes, PERIOD, &DeviceOptions::default()).unwrap()
    }

    fn settle(master: &mut ChangingGrip, force: f64, seconds: f64) {
        for _ in 0..(seconds / PERIOD) as usize {
            master.step(&[force], &[0.0]);
        }
    }

    #[test]
    fn a_hand_that_tightens_holds_where_it_is_and_gives_way_less_from_then_on() {
        let (force, more) = (2.0, 3.0);
        let mut master = held(&[GripChange { at_s: 2.0, scale: 2.0 }]);
        master.start(&[force], &[0.0]);
        settle(&mut master, force, 1.9);
        let before = (master.user_position(0), master.port_force(0));
        assert!((before.0 - force / STIFFNESS).abs() < 1e-9 && (before.1 + force).abs() < 1e-6, "{before:?}");
        settle(&mut master, force, 1.0);
        // No position and no force has jumped, and the muscle has taken half of what the spring held.
        assert!((master.user_position(0) - before.0).abs() < 1e-9, "{}", master.user_position(0));
        assert!((master.port_force(0) - before.1).abs() < 1e-6);
        let held = 0.5 * force * force / STIFFNESS;
        assert!((master.muscle_work() + 0.5 * held).abs() < 1e-9, "{} of {held}", master.muscle_work());
        settle(&mut master, more, 2.0);
        let moved = master.user_position(0) - before.0;
        assert!((moved - (more - force) / (2.0 * STIFFNESS)).abs() < 1e-9, "{moved}");
    }

    #[test]
    fn a_change_in_motion_leaves_position_and_velocity_where_they_are() {
        let mut master = held(&[GripChange { at_s: 0.01, scale: 0.5 }]);
        let mut same = held(&[]);
        master.start(&[1.0], &[0.0]);
        same.start(&[1.0], &[0.0]);
        for _ in 0..50 {
            master.step(&[1.0], &[0.0]);
            same.step(&[1.0], &[0.0]);
        }
        // The sample of the change is the last that both have in common.
        assert_eq!((master.user_position(0), master.user_velocity(0)), (same.user_position(0), same.user_velocity(0)));
        master.step(&[1.0], &[0.0]);
        same.step(&[1.0], &[0.0]);
        // What changed at once is the damper: by half its force over a step.
        let most = 0.6 * 23.0 * same.user_velocity(0) * PERIOD / 0.05;
        assert!((master.user_velocity(0) - same.user_velocity(0)).abs() < most);
        assert_ne!(master.user_velocity(0), same.user_velocity(0));
    }

    #[test]
    fn what_is_not_held_by_springs_and_dampers_cannot_change_its_grip() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant");
        let text = std::fs::read_to_string(folder.join("models/rigid-mass.toml")).unwrap();
        let model = Model::from_toml(&text, "rigid-mass.toml").unwrap();
        let change = [GripChange { at_s: 1.0, scale: 2.0 }];
        let made = ChangingGrip::new(&model, None, &change, PERIOD, &DeviceOptions::default());
        assert!(matches!(made, Err(DeviceError::NoSpringyHand(_))));
    }
}
