//! A servo: a simulated plant, its encoder, and the loop inside of it.

use super::file::{ServoFile, Tone};
use backdrive_control::device::{Device, DeviceError, DeviceOptions, DeviceRole};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// What its loop is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// The motor is off.
    Off,
    /// To this count.
    Position(f64),
    /// To this torque, N m.
    Effort(f64),
    /// An impedance: position rad, velocity rad/s, stiffness N m/rad, damping N m s/rad, torque N m.
    Impedance([f64; 5]),
}

/// What its registers show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Present {
    /// Counts.
    pub position: i32,
    /// Counts per second.
    pub velocity: f64,
    /// Torque of the motor, N m.
    pub effort: f64,
    /// Current with its sign, A. Most servos report its magnitude alone.
    pub current: f64,
    /// Degrees Celsius.
    pub temperature: f64,
}

/// A servo.
pub struct Servo {
    file: ServoFile,
    device: Device,
    steps: u64,
    period_s: f64,
    drive: Drive,
    /// Goals that have arrived and do not act yet: (step from which they act, drive).
    coming: VecDeque<(u64, Drive)>,
    effort: f64,
    before: f64,
    velocity: f64,
}

impl Servo {
    /// A servo at rest with its motor off.
    ///
    /// # Errors
    /// Its plant cannot be simulated as a device driven by a torque.
    pub fn new(file: ServoFile, loop_hz: f64, seed: u64) -> Result<Servo, DeviceError> {
        let period_s = 1.0 / loop_hz;
        let options = DeviceOptions { substeps: None, noise_seed: Some(seed), quantise: true };
        let mut device = Device::new(&file.model, file.grip.as_ref(), DeviceRole::Master, period_s, &options)?;
        let rest = vec![0.0; device.axes()];
        device.start(&rest, &rest);
        let before = device.measured(0);
        Ok(Servo { file, device, steps: 0, period_s, drive: Drive::Off, coming: VecDeque::new(), effort: 0.0, before, velocity: 0.0 })
    }

    /// Address on the bus.
    pub fn id(&self) -> u32 {
        self.file.id
    }

    /// Its file.
    pub fn file(&self) -> &ServoFile {
        &self.file
    }

    /// A goal has arrived.
    pub fn set(&mut self, drive: Drive) {
        let delay = (self.file.goal_delay_s / self.period_s).round() as u64;
        match drive {
            // A motor goes off at once.
            Drive::Off => {
                self.coming.clear();
                self.drive = Drive::Off;
            }
            drive => self.coming.push_back((self.steps + delay, drive)),
        }
    }

    /// Advances by one period of its loop.
    pub fn step(&mut self) {
        while self.coming.front().is_some_and(|(from, _)| *from <= self.steps) {
            if let Some((_, drive)) = self.coming.pop_front() {
                self.drive = drive;
            }
        }
        let position = self.seen();
        // Behind a low-pass of 10 periods, as servos compute it from their encoder.
        self.velocity += 0.1 * ((position - self.before) / self.period_s - self.velocity);
        self.before = position;
        let limit = self.file.torque_limit;
        let wanted = match self.drive {
            Drive::Off => 0.0,
            Drive::Position(count) => {
                let error = (count - self.file.zero) * TAU / self.file.counts_per_turn - position;
                let beyond = (error.abs() - self.file.dead_band).max(0.0).copysign(error);
                self.file.stiffness * beyond - self.file.damping * self.velocity
            }
            Drive::Effort(effort) => effort,
            Drive::Impedance([p, v, kp, kd, torque]) => kp * (p - position) + kd * (v - self.velocity) + torque,
        };
        self.effort = wanted.clamp(-limit, limit);
        self.steps += 1;
        let mut efforts = [0.0; backdrive_msgs::MAX_AXES];
        let mut hands = [0.0; backdrive_msgs::MAX_AXES];
        (efforts[0], hands[0]) = (self.effort, hand(&self.file.hand, self.steps as f64 * self.period_s));
        let axes = self.device.axes();
        self.device.step(&efforts[..axes], &hands[..axes]);
    }

    /// Position as its encoder counts it, rad.
    fn seen(&self) -> f64 {
        let count = TAU / self.file.counts_per_turn;
        // MIT frames carry rad, which the frame itself rounds.
        if self.file.counts_per_turn == TAU { self.device.measured(0) } else { (self.device.measured(0) / count).round() * count }
    }

    /// What its registers show.
    pub fn present(&self) -> Present {
        let per_rad = self.file.counts_per_turn / TAU;
        Present {
            position: (self.seen() * per_rad + self.file.zero).round() as i32,
            velocity: self.velocity * per_rad,
            effort: self.effort,
            current: self.effort / self.file.torque_constant,
            temperature: self.file.temperature,
        }
    }

    /// Position, rad, and velocity, rad/s, as the loop inside sees them.
    pub fn seen_motion(&self) -> (f64, f64) {
        (self.seen(), self.velocity)
    }

    /// Whether its motor is off.
    pub fn is_off(&self) -> bool {
        self.drive == Drive::Off && self.coming.is_empty()
    }
}

/// Position of the hand: its tones, faded in over a second from rest at 0.
fn hand(tones: &[Tone], time_s: f64) -> f64 {
    let fade = time_s.min(1.0);
    let sum: f64 = tones.iter().map(|t| t.amplitude * ((TAU * t.frequency * time_s + t.phase).sin() - t.phase.sin())).sum();
    fade * fade * (3.0 - 2.0 * fade) * sum
}
