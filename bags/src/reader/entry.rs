//! Topics and messages of a bag.

use crate::BagError;
use crate::cdr::Schema;
use backdrive_msgs::Message;
use backdrive_msgs::ros::{self, Facts};
use backdrive_msgs::topic::Kind;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct TopicRef {
    /// Its place in [`crate::Reader::topics`].
    pub index: usize,
    /// Number of its channel in the file.
    pub channel: u16,
    /// Name.
    pub name: String,
    /// Such as `sensor_msgs/msg/JointState`; empty when the file does not say.
    pub type_name: String,
    /// How its messages are encoded; `cdr` for ROS 2.
    pub encoding: String,
    /// How its schema is written; `ros2msg` for ROS 2.
    pub schema_encoding: String,
    /// The schema.
    pub schema: Vec<u8>,
    /// What it carries, if its type is one of ours.
    pub kind: Option<Kind>,
    /// Names of its axes, if the run's header has them.
    pub axes: Vec<String>,
    /// Metadata of its channel.
    pub metadata: BTreeMap<String, String>,
}

impl TopicRef {
    /// A sentence where its messages are of a kind that is not read at all, with what to do; `None` where they can be read.
    pub fn unread(&self) -> Option<String> {
        if self.kind.is_some() {
            return None;
        }
        let error = self.parse_schema().err()?;
        if self.encoding == "cdr" && self.schema_encoding == "ros2msg" {
            return Some(format!("topic {} is not read: {error}", self.name));
        }
        let why = match &error {
            BagError::Field { what, .. } if self.is_protobuf() => what.clone(),
            _ => "cdr with ros2msg, protobuf with its descriptors, and json are read".to_owned(),
        };
        let (topic, encoding) = (&self.name, if self.encoding.is_empty() { "of no stated encoding" } else { &self.encoding });
        let schema = if self.schema_encoding.is_empty() { "no schema".to_owned() } else { format!("a schema of {}", self.schema_encoding) };
        Some(format!(
            "topic {topic} is not read: its messages are {encoding} with {schema}, and {why}. Write its values as CSV or .npz (Python: \
             mcap.reader.make_reader with a decoder factory of that encoding) and import that"
        ))
    }

    fn is_protobuf(&self) -> bool {
        self.encoding == "protobuf" && self.schema_encoding == "protobuf"
    }

    /// Its schema, for reading fields by name.
    ///
    /// Errors: it is neither a ros2msg CDR topic nor protobuf nor JSON, or the schema cannot be parsed.
    pub fn parse_schema(&self) -> Result<Schema, BagError> {
        let wrong = |what: String| BagError::Field { topic: self.name.clone(), field: String::new(), what };
        if self.encoding == "json" {
            return Ok(Schema::json());
        }
        if self.is_protobuf() {
            return Schema::protobuf(&self.type_name, &self.schema).map_err(wrong);
        }
        if self.encoding != "cdr" || self.schema_encoding != "ros2msg" {
            return Err(wrong(format!(
                "messages are {:?} with a {:?} schema; fields can be read of \"cdr\" with \"ros2msg\", of \"protobuf\" and of \"json\"",
                self.encoding, self.schema_encoding
            )));
        }
        let text = std::str::from_utf8(&self.schema).map_err(|_| wrong("the schema is not UTF-8".to_owned()))?;
        Schema::parse(&self.type_name, text).map_err(wrong)
    }
}

/// A message of a bag.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Its topic.
    pub topic: Arc<TopicRef>,
    /// The low 32 bits of its sequence number.
    pub sequence: u32,
    /// When it was recorded, ns: in lockstep its stamp, else since the Unix epoch.
    pub log_time_ns: u64,
    /// When it was sent, ns.
    pub publish_time_ns: u64,
    /// Byte of the file at which its record, or the chunk around it, starts.
    pub offset: u64,
    /// Its bytes.
    pub payload: Vec<u8>,
    /// What the bag records of it beside its bytes, if it is a sample of ours.
    pub facts: Option<Facts>,
}

impl Entry {
    /// The message, if its topic is one of ours; `None` for other people's types, and for their JointStates.
    ///
    /// Errors: the payload does not have the content that its topic requires.
    pub fn message(&self, path: &Path) -> Result<Option<Message>, BagError> {
        let Some(kind) = self.topic.kind else { return Ok(None) };
        match decode(kind, self.facts.as_ref(), &self.payload) {
            Ok(message) => Ok(Some(message)),
            Err(ros::RosError::Foreign { .. }) => Ok(None),
            Err(source) => Err(BagError::Message { path: path.to_owned(), offset: self.offset, topic: self.topic.name.clone(), source }),
        }
    }
}

/// Reads a payload, with the facts that the bag records beside it.
pub(crate) fn decode(kind: Kind, facts: Option<&Facts>, payload: &[u8]) -> Result<Message, ros::RosError> {
    match facts {
        Some(facts) if kind == Kind::Sample => ros::decode_sample(payload, facts).map(Message::Sample),
        _ => ros::decode(kind, payload),
    }
}
