//! Every message as a standard ROS 2 message, for the wire: what `ros2 topic echo`, PlotJuggler, rviz and a
//! Foxglove bridge on another machine show with nothing of ours installed.
//!
//! A sample is a `JointState` whose `header.frame_id` holds what JointState has no field for: `step=123 seq=123 src=89abcdef axes=2 flags=0 layout=1`. A bag
//! holds it in messages of its own ([`super`]), which the wire cannot: samples may be lost here, and a node of another host takes each by its step the moment
//! it comes. The content of a second message would have to be waited for, and could be lost alone. A quantity that was not measured is NaN, so that arrays are
//! as long as there are axes. Gains, status and margin are a `JointState` too, whose `name` has the names of their fields and whose `position` has the values.
//! An event is an `rcl_interfaces/msg/Log`: `name` is the node that reports it, `msg` its sentence, `function` its kind, and `file` carries what `Log` has no
//! field for. Counts travel as floating point, so they are exact up to 2^53.

use super::mark::Mark;
use super::time::Time;
use super::twins::{Form, JointState, JointStateIn};
use super::{RosError, read_cdr};
use crate::text::Text;
use crate::topic::Kind;
use crate::{Event, Gains, Margin, Message, Sample, Status, measured};
use byteorder::LittleEndian;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

const JOINT_STATE: (&str, &str) = ("sensor_msgs", "JointState");
const LOG: (&str, &str) = ("rcl_interfaces", "Log");

/// `Log.level` of each severity of an event, from info on.
const LEVELS: [u8; 3] = [20, 30, 40];

/// Package and name of the standard type that carries a kind of message.
pub fn type_of(kind: Kind) -> (&'static str, &'static str) {
    if kind == Kind::Event { LOG } else { JOINT_STATE }
}

/// Names of the values of a kind that is carried as a list of named numbers; empty for samples and events.
pub fn fields(kind: Kind) -> &'static [&'static str] {
    match kind {
        Kind::Sample | Kind::Event => &[],
        Kind::Gains => &["mu", "lambda", "ramp_s"],
        Kind::Status => &["steps", "missed_deadlines", "lost", "loop_p50_s", "loop_p99_s"],
        Kind::Margin => &["axis", "known", "gain", "factor", "deviation", "frequency_hz", "decay_per_s"],
    }
}

/// `rcl_interfaces/msg/Log`, fields in the order of its definition.
#[derive(Serialize, Deserialize)]
struct Log<'a> {
    stamp: Time,
    level: u8,
    name: Cow<'a, str>,
    msg: Cow<'a, str>,
    file: Cow<'a, str>,
    function: Cow<'a, str>,
    line: u32,
}

/// Writes the CDR of `message`, little endian and without encapsulation header, into `cdr`, replacing what was there. `speaker` is the node that reports an
/// event; `names` are the axes of a sample, or for the other kinds [`fields`] as strings. A `mark` ends the text that holds what the type has no field for,
/// with zeros instead of its tag: see [`super::mark::marked`].
///
/// # Errors
/// None for any value of `message` that can be built today; the encoder's own are passed on.
pub fn encode(message: &Message, speaker: &str, names: &[String], mark: Option<&Mark<'_>>, cdr: &mut Vec<u8>) -> Result<(), RosError> {
    cdr.clear();
    let numbers = |values: &[f64]| listed(message, values);
    let written = match message {
        Message::Event(event) => {
            let mut file = format!(
                "step={} seq={} src={:08x} layout={} severity={} value={} stamp={}",
                event.step, event.sequence, event.source, event.layout, event.severity, event.value, event.stamp_ns
            );
            if let Some(mark) = mark {
                file.push_str(&mark.to_string());
            }
            let level = LEVELS[(event.severity as usize).min(LEVELS.len() - 1)];
            let log = Log {
                stamp: Time::from_ns(event.stamp_ns),
                level,
                name: speaker.into(),
                msg: event.text.as_str().into(),
                file: file.into(),
                function: event.kind.as_str().into(),
                line: 0,
            };
            cdr_encoding::to_writer::<_, LittleEndian, _>(cdr, &log)
        }
        Message::Sample(sample) => joint_state(cdr, sample, names, Form::Wire(mark)),
        Message::Gains(g) => joint_state(cdr, &numbers(&[g.mu, g.lambda, g.ramp_s]), names, Form::WireList(mark)),
        Message::Status(s) => {
            let values = [s.steps as f64, s.missed_deadlines as f64, s.lost as f64, s.loop_p50_s, s.loop_p99_s];
            joint_state(cdr, &numbers(&values), names, Form::WireList(mark))
        }
        Message::Margin(m) => {
            let values = [f64::from(m.axis), f64::from(m.known), m.gain, m.factor, m.deviation, m.frequency_hz, m.decay_per_s];
            joint_state(cdr, &numbers(&values), names, Form::WireList(mark))
        }
    };
    written.map_err(|source| RosError::Cdr { type_name: type_of(message.kind()).1, source })
}

fn joint_state(cdr: &mut Vec<u8>, sample: &Sample, axis_names: &[String], form: Form<'_>) -> Result<(), cdr_encoding::Error> {
    cdr_encoding::to_writer::<_, LittleEndian, _>(cdr, &JointState { sample, axis_names, form })
}

/// A message as a sample whose positions are its values.
fn listed(message: &Message, values: &[f64]) -> Sample {
    let mut sample = Sample {
        layout: message.layout(),
        source: message.source(),
        step: message.step(),
        sequence: message.sequence(),
        stamp_ns: message.stamp_ns(),
        ..Sample::new(values.len())
    };
    sample.position[..values.len()].copy_from_slice(values);
    sample
}

/// Reads the CDR that [`encode`] wrote, in either byte order. What was not measured comes back as the canonical
/// [`crate::NOT_MEASURED`]; the layout version is not judged here: see [`crate::check_layout`].
///
/// # Errors
/// CDR that ends early, or a message of somebody else.
pub fn decode(kind: Kind, little_endian: bool, cdr: &[u8]) -> Result<Message, RosError> {
    if kind == Kind::Event {
        return event(&read_cdr::<Log>("rcl_interfaces/msg/Log", little_endian, cdr)?).map(Message::Event);
    }
    let sample = Sample::try_from(read_cdr::<JointStateIn>("sensor_msgs/msg/JointState", little_endian, cdr)?)?;
    let Sample { layout, source, step, sequence, stamp_ns, position, .. } = sample;
    let expected = fields(kind).len();
    if kind != Kind::Sample && sample.len() != expected {
        return Err(RosError::Inconsistent { what: format!("{} values, a {kind:?} has {expected}", sample.len()) });
    }
    // A NaN becomes 0 only where no NaN can have been sent.
    let count = |i: usize| measured(position[i]).unwrap_or(0.0) as u64;
    Ok(match kind {
        Kind::Sample | Kind::Event => Message::Sample(sample),
        Kind::Gains => {
            let [mu, lambda, ramp_s, ..] = position;
            Message::Gains(Gains { layout, source, step, sequence, stamp_ns, mu, lambda, ramp_s })
        }
        Kind::Status => {
            let (steps, missed_deadlines, lost) = (count(0), count(1), count(2));
            let [_, _, _, loop_p50_s, loop_p99_s, ..] = position;
            Message::Status(Status { layout, source, step, sequence, stamp_ns, steps, missed_deadlines, lost, loop_p50_s, loop_p99_s })
        }
        Kind::Margin => {
            let (axis, known) = (count(0) as u32, count(1) as u32);
            let [_, _, gain, factor, deviation, frequency_hz, decay_per_s, ..] = position;
            let rest = Margin { layout, source, step, sequence, stamp_ns, axis, known, gain, factor, deviation, frequency_hz, decay_per_s };
            Message::Margin(rest)
        }
    })
}

fn event(log: &Log) -> Result<Event, RosError> {
    let foreign = || RosError::Inconsistent { what: format!("a Log with file {:?} was not sent by backdrive", log.file) };
    let find = |key: &str| log.file.split_ascii_whitespace().find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
    let number = |key: &str| find(key).and_then(|v| v.parse::<u64>().ok()).ok_or_else(foreign);
    Ok(Event {
        layout: number("layout")? as u32,
        source: find("src").and_then(|v| u32::from_str_radix(v, 16).ok()).ok_or_else(foreign)?,
        step: number("step")?,
        sequence: number("seq")?,
        stamp_ns: find("stamp").and_then(|v| v.parse().ok()).unwrap_or_else(|| log.stamp.to_ns()),
        severity: number("severity")? as u32,
        reserved: 0,
        value: super::twins::canonical(find("value").and_then(|v| v.parse().ok()).ok_or_else(foreign)?),
        kind: Text::new(&log.function),
        text: Text::new(&log.msg),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LAYOUT, NOT_MEASURED};

    fn there_and_back(message: &Message) -> String {
        let mut payload = Vec::new();
        let names: Vec<String> = fields(message.kind()).iter().map(|f| (*f).to_string()).collect();
        encode(message, "slave", &names, None, &mut payload).unwrap();
        format!("{:?}", decode(message.kind(), true, &payload).unwrap())
    }

    fn messages() -> [Message; 5] {
        let (layout, source, step, sequence, stamp_ns) = (LAYOUT, 0x89ab_cdef, 1 << 40, 7, -3);
        let (kind, text) = (Text::new("stale_input"), Text::new("no force for 0.02 s: it decays"));
        [
            Message::Sample(Sample { step, sequence, stamp_ns: i64::MIN, flags: 5, ..Sample::new(3) }),
            Message::Gains(Gains { layout, source, step, sequence, stamp_ns, mu: 1.0, lambda: 1.0 / 3.0, ramp_s: 0.05 }),
            Message::Event(Event { layout, source, step, sequence, stamp_ns, severity: 1, reserved: 0, value: 0.1 + 0.2, kind, text }),
            Message::Status(Status {
                layout,
                source,
                step,
                sequence,
                stamp_ns,
                steps: (1 << 53) - 1,
                missed_deadlines: 2,
                lost: 3,
                loop_p50_s: 1e-5,
                loop_p99_s: f64::MIN_POSITIVE,
            }),
            Message::Margin(Margin {
                layout,
                source,
                step,
                sequence,
                stamp_ns,
                axis: 1,
                known: crate::margin::KNOWN,
                gain: 0.3,
                factor: 2.4,
                deviation: NOT_MEASURED,
                frequency_hz: 71.0,
                decay_per_s: -4.0,
            }),
        ]
    }

    #[test]
    fn every_kind_comes_back_as_it_was() {
        for message in messages() {
            assert_eq!(there_and_back(&message), format!("{message:?}"));
        }
    }

    #[test]
    fn what_is_cut_off_or_of_somebody_else_is_refused() {
        for message in messages() {
            let mut payload = Vec::new();
            encode(&message, "slave", &[], None, &mut payload).unwrap();
            for end in 0..payload.len() {
                assert!(decode(message.kind(), true, &payload[..end]).is_err(), "{:?} cut at {end}", message.kind());
            }
        }
        let mut payload = Vec::new();
        encode(&messages()[1], "", &[], None, &mut payload).unwrap();
        assert!(decode(Kind::Status, true, &payload).unwrap_err().to_string().contains("a Status has 5"));
    }
}
