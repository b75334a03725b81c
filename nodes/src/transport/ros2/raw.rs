//! Payloads as they are: the messages have an encoder and a decoder of their own, and are judged before they are read.

use super::identity::{Identity, Judged, Run, Why};
use backdrive_msgs::Message;
use backdrive_msgs::ros::{RosError, live};
use backdrive_msgs::topic::Topic;
use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DeserializerAdapter, SerializerAdapter};
use std::convert::Infallible;

/// Bytes out, judged messages in.
pub(super) struct Raw;

/// Both byte orders of plain CDR; other vendors send the encapsulation of version 2 only to readers that ask for it.
const ENCODINGS: &[RepresentationIdentifier] = &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE];

impl SerializerAdapter<Bytes> for Raw {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(value: &Bytes) -> Result<Bytes, Infallible> {
        Ok(value.clone())
    }
}

/// A message that was judged.
pub(super) enum Checked {
    /// Of this run, on this host or another, with the life of its publisher.
    Ours(Message, Run, u64),
    /// Its owner was not asked for.
    Anybodys(Message),
    /// Not of this run; it was not read.
    Refused(Why),
}

impl DeserializerAdapter<Checked> for Raw {
    type Error = RosError;
    type Decoded = Checked;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        ENCODINGS
    }

    fn transform_decoded(decoded: Checked) -> Checked {
        decoded
    }
}

/// Reads messages of one topic, for a node of a run those of the run alone.
#[derive(Clone, Copy)]
pub(super) struct Reads<'a> {
    pub topic: &'a Topic,
    pub identity: Option<&'a Identity>,
}

impl Decode<'_, Checked> for Reads<'_> {
    type Error = RosError;

    fn decode_bytes(self, cdr: &[u8], encoding: RepresentationIdentifier) -> Result<Checked, RosError> {
        let little_endian = encoding == RepresentationIdentifier::CDR_LE;
        let read = || live::decode(self.topic.kind, little_endian, cdr);
        Ok(match self.identity.map(|identity| identity.judge(self.topic, little_endian, cdr)) {
            None => Checked::Anybodys(read()?),
            Some(Judged::Ours { run, life }) => Checked::Ours(read()?, run, life),
            Some(Judged::Refused(why)) => Checked::Refused(why),
        })
    }
}
