//! The ROS 2 form of every message: schema text, CDR both ways.
//!
//! A [`Sample`] is a plain `sensor_msgs/msg/JointState`, so that any tool shows it without our software. Its stamp is the sample's, its arrays are as
//! long as there are axes, and a quantity that was not measured is a NaN. What JointState has no field for ([`Facts`]: step, sequence, source, flags)
//! is written in messages of a type of their own, [`STEPS`], wherever it does not follow by counting on. Older bags have it in `header.frame_id`
//! (`step=123 seq=123 src=89abcdef axes=2 flags=0 layout=1`), with an empty array for a quantity that no axis has; both are read. The other kinds
//! have types of their own in `msg/`.
//!
//! Every payload is a 4-byte encapsulation header, `00 01 00 00`, and little-endian CDR.

mod facts;
mod frame;
pub mod live;
pub mod mark;
mod time;
mod twins;

pub use facts::{Facts, RosError};

use crate::topic::Kind;
use crate::{Message, Sample};
use byteorder::{BigEndian, LittleEndian};
use twins::{EventTwin, Form, GainsTwin, JointState, JointStateIn, MarginTwin, StatusTwin, StepsTwin};

/// The encapsulation header of little-endian CDR.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

// The text of one type, then each dependency behind a line of 80 `=` and its name.
macro_rules! with_header {
    ($text:expr) => {
        concat!(
            $text,
            "================================================================================\nMSG: std_msgs/Header\n",
            "builtin_interfaces/Time stamp\nstring frame_id\n",
            "================================================================================\nMSG: builtin_interfaces/Time\n",
            "int32 sec\nuint32 nanosec\n"
        )
    };
}

/// Name and full text of the schema of the messages that say [`Facts`] of samples.
pub const STEPS: (&str, &str) = ("backdrive_msgs/msg/Steps", with_header!(include_str!("../msg/Steps.msg")));

/// Name and full text (dependencies included) of the ros2msg schema of a kind of message.
pub fn schema(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::Sample => (
            "sensor_msgs/msg/JointState",
            with_header!("std_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"),
        ),
        Kind::Gains => ("backdrive_msgs/msg/Gains", with_header!(include_str!("../msg/Gains.msg"))),
        Kind::Event => ("backdrive_msgs/msg/Event", with_header!(include_str!("../msg/Event.msg"))),
        Kind::Status => ("backdrive_msgs/msg/Status", with_header!(include_str!("../msg/Status.msg"))),
        Kind::Margin => ("backdrive_msgs/msg/Margin", with_header!(include_str!("../msg/Margin.msg"))),
    }
}

/// The kind of message that a ROS type name stands for.
pub fn kind_of(type_name: &str) -> Option<Kind> {
    [Kind::Sample, Kind::Gains, Kind::Event, Kind::Status, Kind::Margin].into_iter().find(|kind| schema(*kind).0 == type_name)
}

/// Writes the payload of `message` into `payload`, replacing what was there (its memory is reused).
///
/// `axis_names` become `JointState.name`; missing ones are called `axis0`, `axis1`, … and names beyond the message's axes are left out. Of a sample its
/// [`Facts`] are not in it: see [`encode_steps`]. Errors: none for any value of `message` that can be built today; the encoder's own are passed on.
pub fn encode(message: &Message, axis_names: &[String], payload: &mut Vec<u8>) -> Result<(), RosError> {
    payload.clear();
    payload.extend_from_slice(&ENCAPSULATION);
    // The encoder counts alignment from where it starts, which is behind the header, as CDR wants.
    match message {
        Message::Sample(sample) => {
            cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &JointState { sample, axis_names, form: Form::Bag })
        }
        Message::Gains(gains) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &GainsTwin::from(gains)),
        Message::Event(event) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &EventTwin::from(event)),
        Message::Status(status) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &StatusTwin::from(status)),
        Message::Margin(margin) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &MarginTwin::from(margin)),
    }
    .map_err(|source| RosError::Cdr { type_name: schema(message.kind()).0, source })
}

/// Writes the facts of `sample`, and of those that follow it on `topic`, into `payload`, replacing what was there.
///
/// Errors: as of [`encode`].
pub fn encode_steps(topic: &str, sample: &Sample, payload: &mut Vec<u8>) -> Result<(), RosError> {
    payload.clear();
    payload.extend_from_slice(&ENCAPSULATION);
    cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &StepsTwin::new(topic, sample))
        .map_err(|source| RosError::Cdr { type_name: STEPS.0, source })
}

/// Reads a payload that [`encode_steps`] wrote: a topic, and what is so of its next sample.
///
/// Errors: a wrong encapsulation header, CDR that ends early.
pub fn decode_steps(payload: &[u8]) -> Result<(String, Facts), RosError> {
    Ok(read::<StepsTwin>(STEPS.0, payload)?.into_facts())
}

/// Whether the header of a JointState holds this stamp to the ns; where it does not, [`Facts::stamp_ns`] does.
pub fn header_holds(stamp_ns: i64) -> bool {
    time::Time::from_ns(stamp_ns).to_ns() == stamp_ns
}

/// Reads a sample that [`encode`] wrote, with `facts` from another source. One that carries its own, as in older bags, is read by those.
///
/// Errors: as of [`decode`].
pub fn decode_sample(payload: &[u8], facts: &Facts) -> Result<Sample, RosError> {
    read::<JointStateIn>(schema(Kind::Sample).0, payload)?.sample(facts)
}

/// Reads a payload that [`encode`] wrote (in either byte order); a sample only where it carries its [`Facts`] itself, as in older bags: see
/// [`decode_sample`] for others.
///
/// What was not measured comes back as the canonical [`crate::NOT_MEASURED`], on axes beyond the
/// message's too; everything else comes back bit for bit. The layout version is not judged here: see
/// [`crate::check_layout`].
///
/// Errors: a wrong encapsulation header, CDR that ends early, a JointState that is not ours.
pub fn decode(kind: Kind, payload: &[u8]) -> Result<Message, RosError> {
    Ok(match kind {
        Kind::Sample => Message::Sample(Sample::try_from(read::<JointStateIn>(schema(kind).0, payload)?)?),
        Kind::Gains => Message::Gains(read::<GainsTwin>(schema(kind).0, payload)?.into()),
        Kind::Event => Message::Event(read::<EventTwin>(schema(kind).0, payload)?.into()),
        Kind::Status => Message::Status(read::<StatusTwin>(schema(kind).0, payload)?.into()),
        Kind::Margin => Message::Margin(read::<MarginTwin>(schema(kind).0, payload)?.into()),
    })
}

/// Reads the CDR of a payload, in either byte order.
fn read<'a, T: serde::Deserialize<'a>>(type_name: &'static str, payload: &'a [u8]) -> Result<T, RosError> {
    match payload {
        [0, order @ (0 | 1), _, _, cdr @ ..] => read_cdr(type_name, *order == 1, cdr),
        _ => Err(RosError::Encapsulation { found: payload.iter().take(4).copied().collect() }),
    }
}

fn read_cdr<'a, T: serde::Deserialize<'a>>(type_name: &'static str, little_endian: bool, cdr: &'a [u8]) -> Result<T, RosError> {
    let result =
        if little_endian { cdr_encoding::from_bytes::<T, LittleEndian>(cdr) } else { cdr_encoding::from_bytes::<T, BigEndian>(cdr) };
    result.map(|(value, _)| value).map_err(|source| RosError::Cdr { type_name, source })
}
