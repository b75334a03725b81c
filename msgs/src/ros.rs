//! The ROS 2 form of every message: schema text, CDR both ways.
//!
//! A [`Sample`] is a plain `sensor_msgs/msg/JointState`, so that any tool shows it with nothing of
//! ours installed. What JointState has no place for stands in `header.frame_id`:
//! `step=123 seq=123 src=89abcdef axes=2 flags=0 layout=1`. A quantity that no axis has is an empty
//! array; a single axis without it is a NaN. The other kinds have types of their own in `msg/`.
//!
//! Every payload is a 4-byte encapsulation header, `00 01 00 00`, and little-endian CDR.

pub mod live;
mod twins;

use crate::topic::Kind;
use crate::{Message, Sample};
use byteorder::{BigEndian, LittleEndian};
use twins::{EventTwin, GainsTwin, JointState, JointStateIn, MarginTwin, StatusTwin};

/// The encapsulation header of little-endian CDR.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// What is wrong with a payload.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// It does not start with the encapsulation header of plain CDR.
    #[error("payload starts with {found:02x?}, expected the CDR encapsulation header 00 01 00 00 (or 00 00 00 00, big endian)")]
    Encapsulation {
        /// Its first bytes, at most four.
        found: Vec<u8>,
    },
    /// Its CDR does not hold the expected fields.
    #[error("payload is not a {type_name}: {source}")]
    Cdr {
        /// ROS name of the expected type.
        type_name: &'static str,
        /// What the CDR reader says.
        source: cdr_encoding::Error,
    },
    /// A JointState of somebody else.
    #[error("JointState with header.frame_id {frame_id:?} was not sent by backdrive: read its fields by name instead")]
    Foreign {
        /// The frame id, cut to 64 bytes.
        frame_id: String,
    },
    /// A JointState of ours whose parts contradict each other.
    #[error("JointState does not fit its header.frame_id: {what}")]
    Inconsistent {
        /// What contradicts what.
        what: String,
    },
}

/// Name and full text (dependencies included) of the ros2msg schema of a kind of message.
pub fn schema(kind: Kind) -> (&'static str, &'static str) {
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
/// `axis_names` become `JointState.name`; missing ones are called `axis0`, `axis1`, … and names beyond
/// the message's axes are left out. Errors: none for any value of `message` as it is built today; the
/// encoder's own are passed on.
pub fn encode(message: &Message, axis_names: &[String], payload: &mut Vec<u8>) -> Result<(), RosError> {
    payload.clear();
    payload.extend_from_slice(&ENCAPSULATION);
    // The encoder counts alignment from where it starts, which is behind the header, as CDR wants.
    match message {
        Message::Sample(sample) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &JointState { sample, axis_names }),
        Message::Gains(gains) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &GainsTwin::from(gains)),
        Message::Event(event) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &EventTwin::from(event)),
        Message::Status(status) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &StatusTwin::from(status)),
        Message::Margin(margin) => cdr_encoding::to_writer::<_, LittleEndian, _>(payload, &MarginTwin::from(margin)),
    }
    .map_err(|source| RosError::Cdr { type_name: schema(message.kind()).0, source })
}

/// Reads a payload that [`encode`] wrote (in either byte order).
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
