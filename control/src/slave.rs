//! The slave with its environment as a node: its servo follows the command, or a controller's force drives it; what it touches pushes back.

use crate::core::{Core, Events, Port, Tick};
use crate::device::Device;
use crate::freshness::{Freshness, bridged_steps};
use crate::motor::Motor;
use backdrive_msgs::{MAX_AXES, Sample, flag};

/// Inputs: `command` (position) or `force` (effort on the motor), for a model whose feedback is a motion or a force. Output: `measured` (position and
/// velocity of the tip, effort = force of the environment on the tip, negative when it pushes against +x).
///
/// Without a new command it holds the last one. The command is cut to the device's travel and speed. A force is that of the motor: at step k the
/// plant is first carried from k-1 to k under the force of step k-1, then measured. Topics are therefore a recording as model files define it.
/// Without a new force the last one is removed as in [`crate::master::Master`].
pub struct Slave {
    device: Device,
    command: Freshness,
    /// Where a force drives it.
    motor: Option<Motor>,
    target: [f64; MAX_AXES],
    stale_steps: u64,
    started: bool,
    was_holding: bool,
    was_finite: bool,
}

impl Slave {
    /// A slave that reports that it holds when no command has come for `stale_after_s`.
    pub fn new(device: Device, stale_after_s: f64, period_s: f64) -> Slave {
        Slave {
            motor: device.is_driven_by_force().then(|| Motor::new(stale_after_s, period_s)),
            device,
            command: Freshness::default(),
            target: [0.0; MAX_AXES],
            stale_steps: bridged_steps(stale_after_s, period_s),
            started: false,
            was_holding: false,
            was_finite: true,
        }
    }

    /// Carries the device under the force of the step before, then hears the new one.
    fn drive(&mut self, tick: &Tick, force: &Port, events: &mut Events) -> u32 {
        let axes = self.device.axes();
        let Some(motor) = &mut self.motor else { return 0 };
        if self.started {
            self.device.step(&motor.applied()[..axes], &[]);
        } else {
            self.device.start(&[], &[]);
            self.started = true;
        }
        motor.step(force, tick.period_s, events, |axis| self.device.axis(axis), axes)
    }

    /// Carries the device along the command.
    fn follow(&mut self, tick: &Tick, command: &Port, events: &mut Events) -> u32 {
        let axes = self.device.axes();
        let mut flags = 0;
        let begun = self.command.begun();
        if let Some(command) = self.command.new_sample(command, |s| s.position[0]) {
            for axis in 0..axes {
                let wanted = command.position[axis];
                if !wanted.is_finite() {
                    continue;
                }
                let limits = self.device.axis(axis);
                let [low, high] = limits.travel.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                let mut target = wanted.clamp(low, high);
                if begun {
                    let reach = limits.speed.unwrap_or(f64::INFINITY) * tick.period_s;
                    target = target.clamp(self.target[axis] - reach, self.target[axis] + reach);
                }
                if target != wanted {
                    flags |= flag::LIMITED;
                }
                self.target[axis] = target;
            }
        }
        let holding = self.command.begun() && self.command.stale_steps > self.stale_steps;
        if holding && !self.was_holding {
            events.push("slave_holds", self.command.stale_steps as f64, 1);
        } else if !holding && self.was_holding {
            events.push("slave_follows", 0.0, 0);
        }
        self.was_holding = holding;
        if holding {
            flags |= flag::STALE;
        }
        if self.started {
            self.device.step(&self.target[..axes], &[]);
        } else {
            self.device.start(&self.target[..axes], &[]);
            self.started = true;
        }
        flags
    }

    /// The device inside.
    pub fn device(&self) -> &Device {
        &self.device
    }
}

impl Core for Slave {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let axes = self.device.axes();
        let flags = match (self.motor.is_some(), inputs) {
            (false, [command, ..]) => self.follow(tick, command, events),
            (true, [_, force, ..]) => self.drive(tick, force, events),
            _ => 0,
        };
        let finite = self.device.is_finite();
        if !finite && self.was_finite {
            events.push("state_not_finite", tick.time_s, 2);
        }
        self.was_finite = finite;
        for axis in 0..axes {
            outputs[0].position[axis] = self.device.measured(axis);
            outputs[0].velocity[axis] = self.device.user_velocity(axis);
            outputs[0].effort[axis] = self.device.port_force(axis);
        }
        outputs[0].flags = flags;
    }
}
