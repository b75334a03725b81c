//! What every bus of joints does, in SI units: read the joints, give them goals, release them.

use std::time::Duration;

/// What one joint answered in one cycle. `None` is what it did not measure or did not answer: absent, never zero.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reading {
    /// Position, rad or m, with sign and zero of the joint's file.
    pub position: Option<f64>,
    /// Velocity, rad/s or m/s.
    pub velocity: Option<f64>,
    /// Torque of the motor at the joint, N m or N. Only where the device reports it with its sign.
    pub effort: Option<f64>,
    /// Current of the motor, A. Without a sign where [`Abilities::current_is_signed`] is false.
    pub current: Option<f64>,
    /// Temperature, degrees Celsius.
    pub temperature: Option<f64>,
    /// The device's own error bits; 0 where it reports none.
    pub status: u32,
}

/// What one joint shall do.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Goal {
    /// Nothing new: it keeps its last goal.
    #[default]
    Keep,
    /// Go to this position, rad or m.
    Position(f64),
    /// Give this torque or force, N m or N.
    Effort(f64),
}

/// Who answers under a joint's address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Its address on the bus.
    pub id: u32,
    /// Its model number, where the protocol has one.
    pub model: Option<u32>,
}

/// What a joint takes and measures, as its protocol and its file state it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Abilities {
    /// Whether it takes goals of position.
    pub takes_position: bool,
    /// Whether it takes goals of torque or force.
    pub takes_effort: bool,
    /// Whether its current has a sign, so that a torque can be computed.
    pub current_is_signed: bool,
}

/// What happened on the wire since the bus was opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Questions that were asked.
    pub asked: u64,
    /// Answers that came whole and in time.
    pub answered: u64,
    /// Questions that were asked again.
    pub retries: u64,
    /// Answers that did not come in time, after all retries.
    pub silent: u64,
    /// Frames whose checksum was wrong.
    pub corrupt: u64,
    /// Answers of somebody who was not asked, or a second time.
    pub strange: u64,
    /// Bytes that belong to no frame.
    pub noise: u64,
}

/// Why a bus does not work.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The port cannot be opened, or is gone.
    #[error("{port}: {what}")]
    Port {
        /// The port.
        port: String,
        /// What is wrong, and what to do.
        what: String,
    },
    /// A joint does not answer.
    #[error("{port}: id {id} does not answer; check power, wiring, id and baud (`backdrive device find {port}`)")]
    Silent {
        /// The port.
        port: String,
        /// The address.
        id: u32,
    },
    /// The protocol cannot do this.
    #[error("{0}")]
    Cannot(String),
}

/// A bus of joints. Every call ends within a bounded time, whatever the wire does.
pub trait Bus: Send {
    /// Number of joints.
    fn joints(&self) -> usize;

    /// What a joint takes and measures.
    fn abilities(&self, joint: usize) -> Abilities;

    /// Asks a joint who it is.
    ///
    /// # Errors
    /// It does not answer, or the port is gone.
    fn identify(&mut self, joint: usize) -> Result<Identity, BusError>;

    /// Reads all joints in one cycle. A joint that does not answer is left at [`Reading::default`].
    ///
    /// # Errors
    /// The port is gone.
    fn read(&mut self, readings: &mut [Reading]) -> Result<(), BusError>;

    /// Sends goals to all joints in one cycle.
    ///
    /// # Errors
    /// The port is gone.
    fn write(&mut self, goals: &[Goal]) -> Result<(), BusError>;

    /// Turns the motors on where they take goals. A position servo first gets its present position as its goal, so that it does not jump.
    ///
    /// # Errors
    /// A joint does not answer, or the port is gone.
    fn engage(&mut self, present: &[Reading]) -> Result<(), BusError>;

    /// Turns all motors off. Done as far as possible: a joint that does not answer does not keep the others on.
    ///
    /// # Errors
    /// The port is gone.
    fn release(&mut self) -> Result<(), BusError>;

    /// What happened on the wire.
    fn counts(&self) -> Counts;

    /// Shortest time of one cycle, by the bytes on the wire alone.
    fn wire_time(&self) -> Duration;
}

impl Counts {
    /// What happened since an earlier count.
    pub fn since(self, earlier: Counts) -> Counts {
        Counts {
            asked: self.asked - earlier.asked,
            answered: self.answered - earlier.answered,
            retries: self.retries - earlier.retries,
            silent: self.silent - earlier.silent,
            corrupt: self.corrupt - earlier.corrupt,
            strange: self.strange - earlier.strange,
            noise: self.noise - earlier.noise,
        }
    }
}
