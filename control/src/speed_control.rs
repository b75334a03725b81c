//! The proportional-integral control that keeps a test bench at a speed by the dynamometer's torque.

use crate::core::{Core, Events, Port, Tick};
use crate::freshness::Freshness;
use backdrive_msgs::{Sample, flag};

/// `T = k_p (w_set - w) + k_i integral of it + added`, the integral held while the torque is at its limit and would go further.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedControl {
    /// N m s/rad.
    pub proportional: f64,
    /// N m/rad.
    pub integral: f64,
    /// Largest torque, N m, above 0.
    pub limit: f64,
    sum: f64,
}

impl SpeedControl {
    /// A controller at rest.
    pub fn new(proportional: f64, integral: f64, limit: f64) -> SpeedControl {
        SpeedControl { proportional, integral, limit, sum: 0.0 }
    }

    /// The torque from now to the next period, N m, and whether it is cut. Speeds in rad/s, `added` in N m.
    pub fn step(&mut self, wanted: f64, speed: f64, added: f64, period_s: f64) -> (f64, bool) {
        let error = wanted - speed;
        let next = self.sum + self.integral * period_s * error;
        let asked = self.proportional * error + next + added;
        let torque = asked.clamp(-self.limit, self.limit);
        // Where it is cut the integral may only come back.
        if torque == asked || (asked - torque) * error < 0.0 {
            self.sum = next;
        }
        (torque, torque != asked)
    }
}

/// Inputs `setpoint` (velocity), `measured` (velocity), `added` (effort); output `command` (effort: what the dynamometer shall give).
///
/// Without a setpoint or a measurement it holds the last one received; before the first of both it requests nothing.
pub struct SpeedControlNode {
    control: SpeedControl,
    fresh: [Freshness; 3],
    held: [f64; 3],
}

impl SpeedControlNode {
    /// The controller as a node.
    pub fn new(control: SpeedControl) -> SpeedControlNode {
        SpeedControlNode { control, fresh: Default::default(), held: [0.0; 3] }
    }
}

impl Core for SpeedControlNode {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        let reads: [fn(&Sample) -> f64; 3] = [|s| s.velocity[0], |s| s.velocity[0], |s| s.effort[0]];
        for (index, read) in reads.into_iter().enumerate() {
            if let Some(sample) = self.fresh[index].new_sample(&inputs[index], read) {
                self.held[index] = read(sample);
            }
        }
        if !(self.fresh[0].begun() && self.fresh[1].begun()) {
            return;
        }
        let (torque, limited) = self.control.step(self.held[0], self.held[1], self.held[2], tick.period_s);
        for axis in 0..outputs[0].len() {
            outputs[0].effort[axis] = torque;
        }
        outputs[0].flags = if limited { flag::LIMITED } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_does_not_wind_the_integral_up() {
        let mut control = SpeedControl::new(1.0, 10.0, 5.0);
        for _ in 0..10_000 {
            assert_eq!(control.step(100.0, 0.0, 0.0, 1e-3), (5.0, true));
        }
        // At the setpoint the torque is off its limit at once.
        assert!(control.step(100.0, 100.0, 0.0, 1e-3).0 < 1.0);
        let mut free = SpeedControl::new(1.0, 10.0, 5.0);
        for _ in 0..100 {
            free.step(0.1, 0.0, 0.0, 1e-3);
        }
        assert!((free.step(0.0, 0.0, 0.5, 1e-3).0 - 0.6).abs() < 1e-12);
    }
}
