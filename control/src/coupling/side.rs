//! What the sides of every law are: what they know, what they send, what they do in a step.

/// What a side knows of its own device at a step, in the slave's units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Own {
    /// Near: mu times the master's position; far: the slave's position; m or rad.
    pub position: f64,
    /// Its velocity, m/s or rad/s.
    pub velocity: f64,
    /// By how much the position has changed since the step before, m or rad.
    pub moved: f64,
    /// Near: force of the hand on the master, over lambda; far: force of the environment on the slave; N or N m.
    pub force: f64,
    /// Near: mu*lambda, by which an inertia of the master is divided to be one in the slave's units; far: not used.
    pub power_scale: f64,
}

/// What one side sends to the other, one number each; what they mean is the law's affair and stands in its file.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Packet {
    /// Travels as a sample's position.
    pub position: f64,
    /// Travels as a sample's velocity.
    pub velocity: f64,
    /// Travels as a sample's effort.
    pub effort: f64,
}

/// The side at the master.
pub trait Near: Send {
    /// One step of `period_s`: the force on the master's motor, N or N m in the slave's units, and what is sent. `heard` is the
    /// packet that has come in this step, if one has.
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet);
}

/// The side at the slave.
pub trait Far: Send {
    /// One step of `period_s`: where the slave shall be, m or rad, and what is sent.
    fn step(&mut self, own: &Own, heard: Option<&Packet>, period_s: f64) -> (f64, Packet);
}

/// What a law's values by default are derived from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Time of one step, s.
    pub period_s: f64,
    /// Longest time from a motion of the master to the force that answers it, by the graph's delays and jitter, s.
    pub round_trip_s: f64,
    /// Steps from the motion of a step to the end of the step in which the force that answers it acts; 0 where it acts within the same step.
    pub held_steps: u64,
}

impl Conditions {
    /// Time from a motion of the master to the middle of the force that answers it, s: half a step and the round trip.
    pub fn answer_s(&self) -> f64 {
        0.5 * self.period_s + self.round_trip_s
    }
}
