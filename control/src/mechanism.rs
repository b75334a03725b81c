//! What a master node moves: a device that is simulated here, or one that is somewhere else.

use crate::device::Device;
use backdrive_plant::model::Axis;

/// A device seen through its axes, stepped at the graph's rate. Positions in m or rad, forces in N or N m.
pub trait Mechanism: Send {
    /// Number of axes.
    fn axes(&self) -> usize;
    /// The axis as the model file describes it: its limits are kept by who drives it.
    fn axis(&self, axis: usize) -> &Axis;
    /// Starts at rest under the motor's force and with the hand of each axis where it is given.
    fn start(&mut self, force: &[f64], hand: &[f64]);
    /// Advances by one period: the force was held over it, the hand ran in a straight line to where it is now.
    fn step(&mut self, force: &[f64], hand: &[f64]);
    /// Measured position at the tip.
    fn measured(&self, axis: usize) -> f64;
    /// Position of the user's body; NaN where it is not known.
    fn user_position(&self, axis: usize) -> f64;
    /// Velocity of the user's body; NaN where it is not known.
    fn user_velocity(&self, axis: usize) -> f64;
    /// Force of the hand on the user's body, positive along +x; NaN where it is not known.
    fn port_force(&self, axis: usize) -> f64;
    /// Whether it can go on: its state is finite, and it answers.
    fn is_finite(&self) -> bool;
}

impl Mechanism for Device {
    fn axes(&self) -> usize {
        Device::axes(self)
    }

    fn axis(&self, axis: usize) -> &Axis {
        Device::axis(self, axis)
    }

    fn start(&mut self, force: &[f64], hand: &[f64]) {
        Device::start(self, force, hand);
    }

    fn step(&mut self, force: &[f64], hand: &[f64]) {
        Device::step(self, force, hand);
    }

    fn measured(&self, axis: usize) -> f64 {
        Device::measured(self, axis)
    }

    fn user_position(&self, axis: usize) -> f64 {
        Device::user_position(self, axis)
    }

    fn user_velocity(&self, axis: usize) -> f64 {
        Device::user_velocity(self, axis)
    }

    fn port_force(&self, axis: usize) -> f64 {
        Device::port_force(self, axis)
    }

    fn is_finite(&self) -> bool {
        Device::is_finite(self)
    }
}
