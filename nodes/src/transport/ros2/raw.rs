//! Payloads as they are: the messages have an encoder and a decoder of their own.

use backdrive_msgs::Message;
use backdrive_msgs::ros::{RosError, live};
use backdrive_msgs::topic::Kind;
use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DeserializerAdapter, SerializerAdapter};
use std::convert::Infallible;

/// Bytes out, [`Message`]s or text in.
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

impl DeserializerAdapter<Message> for Raw {
    type Error = RosError;
    type Decoded = Message;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        ENCODINGS
    }

    fn transform_decoded(decoded: Message) -> Message {
        decoded
    }
}

/// Reads messages of one kind.
#[derive(Clone, Copy)]
pub(super) struct Reads(pub Kind);

impl Decode<'_, Message> for Reads {
    type Error = RosError;

    fn decode_bytes(self, cdr: &[u8], encoding: RepresentationIdentifier) -> Result<Message, RosError> {
        live::decode(self.0, encoding == RepresentationIdentifier::CDR_LE, cdr)
    }
}
