//! What a signal is.

use backdrive_plant::recording::units::Kind;
use serde::Serialize;

/// What a signal probably is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Time of the rows.
    Time,
    /// Target that a drive is given: a position.
    Command,
    /// Position or angle.
    Position,
    /// Velocity.
    Velocity,
    /// Acceleration.
    Acceleration,
    /// Torque or force.
    Effort,
    /// Motor current.
    Current,
    /// Voltage.
    Voltage,
    /// Temperature.
    Temperature,
    /// A number that counts rows, or that numbers runs.
    Counter,
    /// It has one value throughout, and its name does not say what it is.
    Constant,
    /// Neither its name nor the data say.
    Unknown,
}

impl Quantity {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Quantity::Time => "time",
            Quantity::Command => "command",
            Quantity::Position => "position",
            Quantity::Velocity => "velocity",
            Quantity::Acceleration => "acceleration",
            Quantity::Effort => "torque or force",
            Quantity::Current => "current",
            Quantity::Voltage => "voltage",
            Quantity::Temperature => "temperature",
            Quantity::Counter => "counter",
            Quantity::Constant => "constant",
            Quantity::Unknown => "unknown",
        }
    }

    /// The key of a joint under which a set names such a column, as in `[joints.elbow]`.
    pub fn key(self) -> Option<&'static str> {
        match self {
            Quantity::Position => Some("position"),
            Quantity::Velocity => Some("velocity"),
            Quantity::Effort => Some("torque"),
            Quantity::Current => Some("current"),
            _ => None,
        }
    }

    /// Whether a sensor measures it, in contrast to what a computer writes.
    pub fn is_measured(self) -> bool {
        matches!(self, Quantity::Position | Quantity::Velocity | Quantity::Acceleration | Quantity::Effort | Quantity::Current)
    }

    /// Whether it is a torque, a force or a current.
    pub fn is_drive(self) -> bool {
        matches!(self, Quantity::Effort | Quantity::Current)
    }

    /// What a unit of this kind measures.
    pub fn of_kind(kind: Kind) -> Option<Quantity> {
        Some(match kind {
            Kind::Time => Quantity::Time,
            Kind::Length | Kind::Angle => Quantity::Position,
            Kind::Speed | Kind::AngularSpeed => Quantity::Velocity,
            Kind::Acceleration | Kind::AngularAcceleration => Quantity::Acceleration,
            Kind::Force | Kind::Torque => Quantity::Effort,
            Kind::Current => Quantity::Current,
            Kind::Count => return None,
        })
    }
}

/// Which device of a pair a signal belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The one that a person moves.
    Leader,
    /// The one that follows.
    Follower,
}
