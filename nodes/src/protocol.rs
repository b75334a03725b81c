//! What the supervisor and a node process say to each other: one JSON object per line, the supervisor's
//! on the node's standard input, the node's on its standard output. The end of standard input means
//! that the supervisor is gone, and the node ends.

use backdrive_msgs::{Margin, margin, measured};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Kind of the event that somebody who is not of the run sends on one of its topics. Where that topic moves something, which is severity 2, the run
/// ends.
pub const STRANGER: &str = "stranger";

/// From the supervisor to a node.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "say", rename_all = "snake_case")]
pub enum ToNode {
    /// Every node is connected: step 0 is due at this CLOCK_MONOTONIC time, ns. For a node that was
    /// restarted the time is in the past and it joins at the step that is due.
    Start {
        /// CLOCK_MONOTONIC, ns.
        t0_ns: i64,
        /// Unix time at that moment, ns, for stamps.
        unix_ns: i64,
    },
    /// Finish the step at hand and end.
    Stop,
    /// Change the gains.
    Gains {
        /// Position scale.
        mu: f64,
        /// Force scale.
        lambda: f64,
        /// Ramp, s.
        ramp_s: f64,
    },
    /// Leave the canceller out of the loop, or take it back.
    Canceller {
        /// Whether it subtracts.
        on: bool,
        /// Time over which it fades, s.
        ramp_s: f64,
    },
    /// Publish an event that is not the node's own, such as a remark of somebody who watches: so the recorder has it.
    Note(Note),
}

/// An event that a node publishes for somebody else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Note {
    /// 0 info, 1 warning, 2 error.
    pub severity: u32,
    /// Machine-readable name, at most 32 bytes.
    pub kind: String,
    /// A sentence; what is beyond 128 bytes is cut off.
    pub text: String,
    /// A number that belongs to it.
    pub value: Option<f64>,
}

/// From a node to the supervisor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "say", rename_all = "snake_case")]
pub enum FromNode {
    /// Publishers and subscribers exist.
    Created,
    /// Every topic that it hears has its publisher and every topic that it speaks on has the listeners the graph names.
    Ready,
    /// Not ready after a while, because these are missing.
    Waiting {
        /// Such as `/master/measured_js: no publisher`.
        missing: Vec<String>,
    },
    /// About ten times a second.
    Status(NodeStatus),
    /// Something happened.
    Event {
        /// Step at which it happened.
        step: u64,
        /// 0 info, 1 warning, 2 error.
        severity: u32,
        /// Machine-readable name.
        kind: String,
        /// A sentence.
        text: String,
        /// A number that belongs to it.
        value: Option<f64>,
    },
    /// The same of a node that shares the process of the one that speaks.
    Of {
        /// Name of the node.
        node: String,
        /// Its status, or an event of it.
        said: Box<FromNode>,
    },
    /// It has ended as it should; the last line.
    Done(NodeStatus),
    /// It ends because of this; the last line.
    Failed {
        /// One sentence.
        error: String,
        /// Exit code that the command line should end with.
        code: u8,
    },
}

/// How a node is doing. Small and without a heap, because it is sent while stepping.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeStatus {
    /// Steps done.
    pub steps: u64,
    /// Steps that ended after their deadline.
    pub missed_deadlines: u64,
    /// Samples found missing by sequence number, over all inputs.
    pub lost: u64,
    /// Messages refused because their sender is not of the run, over all inputs.
    #[serde(default)]
    pub refused: u64,
    /// Time for one step, waiting for inputs included, median, µs.
    pub loop_p50_us: f64,
    /// 99th percentile, µs.
    pub loop_p99_us: f64,
    /// Largest magnitude of effort on its outputs since the last status, N.
    pub peak_effort: f64,
    /// Only the recorder: messages written and bytes of the bag so far.
    pub recorded: Option<(u64, u64)>,
    /// Only the scaling: the loop's stability margin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin: Option<MarginStatus>,
}

/// The loop's stability margin, as in [`Margin`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct MarginStatus {
    /// One of [`margin`].
    pub known: u32,
    /// mu*lambda now in force.
    pub gain: f64,
    /// Factor by which it may rise until the loop is at its stability limit; with [`margin::ABOVE`] at least that factor.
    pub factor: Option<f64>,
    /// Standard deviation of the factor, as a share of it.
    pub deviation: Option<f64>,
    /// What the loop would oscillate at there, Hz; 0 for running away.
    pub frequency_hz: Option<f64>,
    /// How fast the reflected force above 8 Hz dies now, 1/s; negative where it grows.
    pub decay_per_s: Option<f64>,
}

impl From<&Margin> for MarginStatus {
    fn from(m: &Margin) -> MarginStatus {
        MarginStatus {
            known: m.known,
            gain: m.gain,
            factor: measured(m.factor),
            deviation: measured(m.deviation),
            frequency_hz: measured(m.frequency_hz),
            decay_per_s: measured(m.decay_per_s),
        }
    }
}

impl fmt::Display for MarginStatus {
    /// Such as `margin 2.4x at 71 Hz`, `margin over 8x`, `margin unknown (no dither)`; then what a ring-down did.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.known, self.factor) {
            (margin::KNOWN, Some(factor)) => match self.frequency_hz.filter(|hz| *hz > 0.0) {
                Some(hz) => write!(f, "margin {}x at {hz:.0} Hz", Times(factor))?,
                None => write!(f, "margin {}x to running away", Times(factor))?,
            },
            (margin::ABOVE, Some(factor)) => write!(f, "margin over {}x", Times(factor))?,
            (margin::NO_DITHER, _) => write!(f, "margin unknown (no dither)")?,
            (margin::FREE, _) => write!(f, "margin unknown (no contact for 0.6 s)")?,
            (margin::SETTLING, _) => write!(f, "margin unknown (needs 1.2 s of contact)")?,
            (margin::LATE, _) => write!(f, "margin unknown (contact forces come late)")?,
            _ => write!(f, "margin unknown (dither too weak)")?,
        }
        match self.decay_per_s {
            Some(decay) if decay >= 0.0 => write!(f, ", decays at {decay:.0} /s"),
            Some(decay) => write!(f, ", grows at {:.0} /s", -decay),
            None => Ok(()),
        }
    }
}

/// Two digits.
struct Times(f64);

impl fmt::Display for Times {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            x if x >= 100.0 => write!(f, "100"),
            x if x >= 9.95 => write!(f, "{x:.0}"),
            x if x >= 1.095 => write!(f, "{x:.1}"),
            x => write!(f, "{x:.2}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_reads_as_a_person_says_it() {
        let known = MarginStatus { known: margin::KNOWN, gain: 0.3, factor: Some(2.43), frequency_hz: Some(70.8), ..Default::default() };
        assert_eq!(known.to_string(), "margin 2.4x at 71 Hz");
        assert_eq!(MarginStatus { frequency_hz: Some(0.0), ..known }.to_string(), "margin 2.4x to running away");
        assert_eq!(MarginStatus { known: margin::ABOVE, factor: Some(8.1), ..known }.to_string(), "margin over 8.1x");
        assert_eq!(MarginStatus { known: margin::FREE, factor: None, ..known }.to_string(), "margin unknown (no contact for 0.6 s)");
        let none = MarginStatus { known: margin::NO_DITHER, factor: None, decay_per_s: Some(-4.6), ..known };
        assert_eq!(none.to_string(), "margin unknown (no dither), grows at 5 /s");
        assert_eq!(MarginStatus { decay_per_s: Some(12.3), ..none }.to_string(), "margin unknown (no dither), decays at 12 /s");
        assert_eq!(MarginStatus { known: 99, ..none }.to_string(), "margin unknown (dither too weak), grows at 5 /s");
    }
}
