//! What travels between the nodes of a graph.
//!
//! Everything is a fixed-layout `#[repr(C)]` value, so that it can cross shared memory without being copied or parsed. Each has one ROS 2 form, so
//! that bags and other machines see ordinary messages. [`Sample`] is a `sensor_msgs/msg/JointState`; [`Gains`], [`Event`], [`Status`] and [`Margin`]
//! have twins in `msg/*.msg`. SI units; a rotational axis uses rad and N m.

pub mod ros;
pub mod text;
pub mod topic;

use iceoryx2::prelude::ZeroCopySend;
use text::Text;

/// Layout version of everything in this crate. A receiver refuses any other.
pub const LAYOUT: u32 = 1;

/// Most axes a device may have.
pub const MAX_AXES: usize = 8;

/// The value of a quantity that was not measured. It is a NaN, never to be confused with 0; use [`measured`] to read a quantity.
pub const NOT_MEASURED: f64 = f64::NAN;

/// `Some(value)` if the quantity was measured.
pub fn measured(value: f64) -> Option<f64> {
    if value.is_nan() { None } else { Some(value) }
}

/// State or command of a device's axes at one step of the loop.
///
/// A quantity that was not measured or is not commanded is [`NOT_MEASURED`].
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("backdrive/Sample/1")]
#[repr(C)]
pub struct Sample {
    /// [`LAYOUT`] of the sender.
    pub layout: u32,
    /// Who sent it: [`source_id`] of the node's name.
    pub source: u32,
    /// Step of the loop that it belongs to: time is `step / rate_hz` since the start.
    pub step: u64,
    /// Counts the samples that this publisher has sent on this topic, from 0. A hole is a loss.
    pub sequence: u64,
    /// ns since the Unix epoch when it was made; in lockstep ns of simulated time since the start.
    pub stamp_ns: i64,
    /// Number of axes that are valid, at most [`MAX_AXES`].
    pub axes: u32,
    /// Bits of [`flag`]; 0 when there is nothing to say.
    pub flags: u32,
    /// m or rad.
    pub position: [f64; MAX_AXES],
    /// m/s or rad/s.
    pub velocity: [f64; MAX_AXES],
    /// N or N m.
    pub effort: [f64; MAX_AXES],
}

/// Bits of [`Sample::flags`].
pub mod flag {
    /// The input behind this sample was stale: force decays, position is held.
    pub const STALE: u32 = 1;
    /// A clamp or a rate limit acted.
    pub const LIMITED: u32 = 2;
    /// The guard has backed a gain off.
    pub const GUARDED: u32 = 4;
}

impl Sample {
    /// A sample of `axes` axes on which nothing is measured yet.
    ///
    /// `axes` beyond [`MAX_AXES`] is cut to it.
    pub fn new(axes: usize) -> Sample {
        Sample {
            layout: LAYOUT,
            source: 0,
            step: 0,
            sequence: 0,
            stamp_ns: 0,
            axes: axes.min(MAX_AXES) as u32,
            flags: 0,
            position: [NOT_MEASURED; MAX_AXES],
            velocity: [NOT_MEASURED; MAX_AXES],
            effort: [NOT_MEASURED; MAX_AXES],
        }
    }

    /// Number of valid axes, as an index bound.
    #[inline]
    pub fn len(&self) -> usize {
        (self.axes as usize).min(MAX_AXES)
    }

    /// Whether it has no axis at all.
    pub fn is_empty(&self) -> bool {
        self.axes == 0
    }

    /// Bit-for-bit equality, in which a quantity that was not measured equals itself.
    pub fn same_bits(&self, other: &Sample) -> bool {
        let bits = |a: &[f64; MAX_AXES], b: &[f64; MAX_AXES]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        (self.layout, self.source, self.step, self.sequence, self.stamp_ns, self.axes, self.flags)
            == (other.layout, other.source, other.step, other.sequence, other.stamp_ns, other.axes, other.flags)
            && bits(&self.position, &other.position)
            && bits(&self.velocity, &other.velocity)
            && bits(&self.effort, &other.effort)
    }
}

/// The gains in force from `step` on.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("backdrive/Gains/1")]
#[repr(C)]
pub struct Gains {
    /// [`LAYOUT`] of the sender.
    pub layout: u32,
    /// [`source_id`] of the sender.
    pub source: u32,
    /// Step from which they hold.
    pub step: u64,
    /// Count on this topic, from 0.
    pub sequence: u64,
    /// As [`Sample::stamp_ns`].
    pub stamp_ns: i64,
    /// Position scale from master to slave, mu (no unit).
    pub mu: f64,
    /// Force scale from slave to master, lambda (no unit).
    pub lambda: f64,
    /// Time over which a change ramps, s.
    pub ramp_s: f64,
}

/// Something happened that a person should know.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("backdrive/Event/1")]
#[repr(C)]
pub struct Event {
    /// [`LAYOUT`] of the sender.
    pub layout: u32,
    /// [`source_id`] of the sender.
    pub source: u32,
    /// Step at which it happened.
    pub step: u64,
    /// Count on this topic, from 0.
    pub sequence: u64,
    /// As [`Sample::stamp_ns`].
    pub stamp_ns: i64,
    /// 0 info, 1 warning, 2 error.
    pub severity: u32,
    /// Keeps the layout free of padding.
    pub reserved: u32,
    /// A number that belongs to it, or [`NOT_MEASURED`].
    pub value: f64,
    /// Machine-readable name, such as `stale_input`.
    pub kind: Text<32>,
    /// One sentence for a person.
    pub text: Text<128>,
}

/// How a node is doing; sent about ten times a second of real time, or of simulated time in lockstep.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("backdrive/Status/1")]
#[repr(C)]
pub struct Status {
    /// [`LAYOUT`] of the sender.
    pub layout: u32,
    /// [`source_id`] of the sender.
    pub source: u32,
    /// Step at which it was taken.
    pub step: u64,
    /// Count on this topic, from 0.
    pub sequence: u64,
    /// As [`Sample::stamp_ns`].
    pub stamp_ns: i64,
    /// Steps done since the start.
    pub steps: u64,
    /// Steps that ended after their deadline; always 0 in lockstep.
    pub missed_deadlines: u64,
    /// Samples found missing by sequence number, over all inputs.
    pub lost: u64,
    /// Time from the start of a step's inputs being waited for to its outputs being sent, s: median since the last status. In lockstep it is 0,
    /// because a lockstep bag holds nothing that depends on the machine.
    pub loop_p50_s: f64,
    /// The same, 99th percentile, s.
    pub loop_p99_s: f64,
}

/// The stability margin of the running loop, of the axis that is nearest to its limit; sent about ten times a second like [`Status`].
///
/// A message of its own, so that what was recorded before there was one reads as it did.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("backdrive/Margin/1")]
#[repr(C)]
pub struct Margin {
    /// [`LAYOUT`] of the sender.
    pub layout: u32,
    /// [`source_id`] of the sender.
    pub source: u32,
    /// Step at which it was taken.
    pub step: u64,
    /// Count on this topic, from 0.
    pub sequence: u64,
    /// As [`Sample::stamp_ns`].
    pub stamp_ns: i64,
    /// The axis, from 0.
    pub axis: u32,
    /// What is known: one of [`margin`].
    pub known: u32,
    /// The gain now in force, mu*lambda, no unit.
    pub gain: f64,
    /// Factor by which the gain may rise until the loop is at its stability limit, no unit; with [`margin::ABOVE`] at least that factor; else
    /// [`NOT_MEASURED`].
    pub factor: f64,
    /// Standard deviation of `factor`, as a share of it, or [`NOT_MEASURED`].
    pub deviation: f64,
    /// Frequency at which it would oscillate at its stability limit, Hz; 0 for a loop that runs away without oscillating; or [`NOT_MEASURED`].
    pub frequency_hz: f64,
    /// How fast the reflected force above 8 Hz dies now, 1/s; negative where it grows; [`NOT_MEASURED`] where nothing rings.
    pub decay_per_s: f64,
}

/// Values of [`Margin::known`].
pub mod margin {
    /// Nothing: there is no dither to identify it with.
    pub const NO_DITHER: u32 = 0;
    /// Nothing: the slave touches nothing, or not for the 0.6 s of a window.
    pub const FREE: u32 = 1;
    /// Nothing: the dither is lost in what else moves.
    pub const NOISY: u32 = 2;
    /// The margin is at least this.
    pub const ABOVE: u32 = 3;
    /// The margin is this.
    pub const KNOWN: u32 = 4;
    /// Nothing yet: the slave is in contact, and three windows are needed (1.2 s).
    pub const SETTLING: u32 = 5;
    /// Nothing: too many contact forces come late for a whole window of the loop.
    pub const LATE: u32 = 6;
}

/// The 32-bit FNV-1a hash of a node's name: it identifies the sender of a sample without a string.
pub const fn source_id(name: &str) -> u32 {
    let (bytes, mut hash, mut i) = (name.as_bytes(), 0x811c_9dc5_u32, 0);
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u32).wrapping_mul(0x0100_0193);
        i += 1;
    }
    hash
}

/// Any message, with its topic's kind.
#[derive(Debug, Clone, Copy)]
pub enum Message {
    /// Axes of a device.
    Sample(Sample),
    /// Gains of the scaling.
    Gains(Gains),
    /// Something happened.
    Event(Event),
    /// A node's health.
    Status(Status),
    /// The loop's stability margin.
    Margin(Margin),
}

/// A message of a layout that this program does not speak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("message layout {found} is not {LAYOUT}: every program of a graph must be built from the same version")]
pub struct WrongLayout {
    /// Layout version of the sender.
    pub found: u32,
}

/// Refuses what was sent with another layout version than [`LAYOUT`].
pub fn check_layout(layout: u32) -> Result<(), WrongLayout> {
    if layout == LAYOUT { Ok(()) } else { Err(WrongLayout { found: layout }) }
}

impl Message {
    /// What kind of topic carries it.
    pub fn kind(&self) -> topic::Kind {
        match self {
            Message::Sample(_) => topic::Kind::Sample,
            Message::Gains(_) => topic::Kind::Gains,
            Message::Event(_) => topic::Kind::Event,
            Message::Status(_) => topic::Kind::Status,
            Message::Margin(_) => topic::Kind::Margin,
        }
    }

    /// Layout version of the sender.
    pub fn layout(&self) -> u32 {
        each!(self, message => message.layout)
    }

    /// [`source_id`] of the sender.
    pub fn source(&self) -> u32 {
        each!(self, message => message.source)
    }

    /// Step of the loop that it belongs to.
    pub fn step(&self) -> u64 {
        each!(self, message => message.step)
    }

    /// Its count on its topic, from 0.
    pub fn sequence(&self) -> u64 {
        each!(self, message => message.sequence)
    }

    /// As [`Sample::stamp_ns`].
    pub fn stamp_ns(&self) -> i64 {
        each!(self, message => message.stamp_ns)
    }
}

/// The same expression for whichever message it is.
macro_rules! each {
    ($any:expr, $message:ident => $value:expr) => {
        match $any {
            Message::Sample($message) => $value,
            Message::Gains($message) => $value,
            Message::Event($message) => $value,
            Message::Status($message) => $value,
            Message::Margin($message) => $value,
        }
    };
}
use each;
