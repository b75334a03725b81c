//! The causes that are known, and what they are called.

use serde::Serialize;

/// What can be the cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CauseKind {
    /// mu*lambda is beyond what the real device allows.
    GainTooHigh,
    /// The way is long, or the rate low.
    Delay,
    /// Samples are lost or come in bursts.
    Loss,
    /// The hand grips otherwise than the canceller assumes.
    Grip,
    /// The canceller subtracts more at rest than the force puts in.
    OverCancelling,
    /// A mass that the canceller does not know.
    Inertia,
    /// A compliance that the canceller does not know.
    Compliance,
    /// Dry friction that was left out.
    DryFriction,
    /// Dry friction in the follower that makes it go in stairs.
    Stiction,
    /// Backlash that was left out.
    Backlash,
    /// Hysteresis that was left out.
    Hysteresis,
    /// Other effects, or other parameters, than the canceller's model has.
    OtherPhysics,
    /// A filter's lag.
    FilterLag,
    /// A coarse or noisy position.
    CoarseSensor,
    /// A sensor that stands still.
    DeadSensor,
    /// A sensor that ends at a value.
    RailedSensor,
    /// A sensor of another scale.
    ScaledSensor,
    /// A sensor whose sign is turned round.
    WrongSign,
    /// A sensor that is late.
    LateSensor,
    /// A loop or a signal that is renewed too seldom.
    Rate,
    /// One factor on all forces of a device.
    TorqueConstant,
    /// A servo that is stronger or weaker than its model.
    Servo,
    /// An environment that is stiffer or softer than the graph states.
    Environment,
    /// A motor at its limit, or a device at the end of its travel.
    Saturation,
    /// The clock of a node.
    Clock,
    /// Two nodes that speak on one topic.
    TwoPublishers,
    /// A node differs from its graph, by none of these causes.
    Unknown,
}

impl CauseKind {
    /// For a person.
    pub fn words(self) -> &'static str {
        match self {
            CauseKind::GainTooHigh => "the gain mu*lambda is too high for this device",
            CauseKind::Delay => "delay in the loop",
            CauseKind::Loss => "lost samples or jitter",
            CauseKind::Grip => "a grip that differs from the canceller's",
            CauseKind::OverCancelling => "the canceller subtracts too much at rest",
            CauseKind::Inertia => "inertia that is missing from the canceller's model",
            CauseKind::Compliance => "compliance that is missing from the canceller's model",
            CauseKind::DryFriction => "dry friction that is missing from the model",
            CauseKind::Stiction => "stiction in the follower",
            CauseKind::Backlash => "backlash that is missing from the model",
            CauseKind::Hysteresis => "hysteresis that is missing from the model",
            CauseKind::OtherPhysics => "the master differs from the canceller's model",
            CauseKind::FilterLag => "lag of a filter",
            CauseKind::CoarseSensor => "position resolution or noise",
            CauseKind::DeadSensor => "a dead sensor",
            CauseKind::RailedSensor => "a saturated sensor",
            CauseKind::ScaledSensor => "a sensor of the wrong scale",
            CauseKind::WrongSign => "a signal of the wrong sign",
            CauseKind::LateSensor => "a delayed sensor",
            CauseKind::Rate => "a rate that is too low",
            CauseKind::TorqueConstant => "a wrong torque constant: one factor on all forces of a device",
            CauseKind::Servo => "a servo that differs from its model",
            CauseKind::Environment => "an environment that differs from the graph's",
            CauseKind::Saturation => "a limit of the device",
            CauseKind::Clock => "the clock: a node could not keep its rate",
            CauseKind::TwoPublishers => "two publishers on one topic",
            CauseKind::Unknown => "a node that does not behave as the graph states",
        }
    }
}
