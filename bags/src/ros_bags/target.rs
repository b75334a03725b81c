//! The MCAP file for other people's messages, and the information on them.

use crate::cdr::{FieldPath, Schema};
use crate::whole::Whole;
use crate::writer::reason;
use crate::{BagError, clock_remarks};
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// What was imported.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RosbagReport {
    /// Messages of all topics.
    pub messages: u64,
    /// Topics, in the order in which they turned up.
    pub topics: Vec<RosbagTopic>,
    /// What a person should know of all of it: a sentence each.
    pub notes: Vec<String>,
}

/// A topic that was imported.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RosbagTopic {
    /// As in the bag.
    pub name: String,
    /// Type of its messages, as ROS 2 calls it.
    pub type_name: String,
    /// Messages.
    pub messages: u64,
    /// What a person should know of it: a sentence each.
    pub notes: Vec<String>,
    /// What is wrong with its clock (the headers' stamps where all are filled in, else the times of recording): a sentence each.
    pub clock: Vec<String>,
}

/// How the messages of a topic are stored.
pub(crate) struct Form<'a> {
    pub(crate) type_name: &'a str,
    /// `ros2msg`, `ros1msg`, or nothing where there is no definition.
    pub(crate) schema_encoding: &'a str,
    pub(crate) definition: &'a str,
    /// `cdr` or `ros1`.
    pub(crate) encoding: &'a str,
    /// Quality of service that was offered, in rosbag2's own words; may be empty.
    pub(crate) qos: &'a str,
}

pub(crate) struct Target {
    path: PathBuf,
    whole: Whole,
    mcap: mcap::Writer<BufWriter<File>>,
    topics: Vec<Topic>,
}

struct Topic {
    channel: u16,
    sequence: u32,
    /// Of messages whose numbers can be read.
    schema: Option<Schema>,
    /// Where its header has its stamp.
    stamp: Option<FieldPath>,
    /// The joints of its first message, and the number of the first that has others, or in other places.
    joints: Vec<String>,
    changed: Option<u64>,
    stamps: Vec<i64>,
    logged: Vec<i64>,
    told: RosbagTopic,
}

impl Target {
    pub(crate) fn create(path: &Path, overwrite: bool) -> Result<Target, BagError> {
        let whole = Whole::begin(path, overwrite)?;
        let file = whole.file()?;
        let options = mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("backdrive ", env!("CARGO_PKG_VERSION")))
            .compression(Some(mcap::Compression::Lz4))
            .compression_threads(0);
        let mcap = options.create(BufWriter::with_capacity(1 << 17, file)).map_err(failed(path))?;
        Ok(Target { path: path.to_owned(), whole, mcap, topics: Vec::new() })
    }

    /// The number of a topic; one that is there already has the same.
    pub(crate) fn topic(&mut self, name: &str, form: &Form, note: Option<String>) -> Result<usize, BagError> {
        let told_of = |topic: &Topic| topic.told.name == name && topic.told.type_name == form.type_name;
        if let Some(place) = self.topics.iter().position(told_of) {
            return Ok(place);
        }
        let failed = failed(&self.path);
        let schema = self.mcap.add_schema(form.type_name, form.schema_encoding, form.definition.as_bytes());
        let metadata = match form.qos.is_empty() {
            true => BTreeMap::new(),
            false => BTreeMap::from([("offered_qos_profiles".to_owned(), form.qos.to_owned())]),
        };
        let channel = schema.and_then(|schema| self.mcap.add_channel(schema, name, form.encoding, &metadata)).map_err(failed)?;
        let parsed = (form.encoding == "cdr" && !form.schema_encoding.is_empty())
            .then(|| Schema::parse(form.type_name, form.definition))
            .transpose();
        let (schema, note) = match parsed {
            Ok(schema) => (schema, note),
            Err(what) => (None, Some(format!("it is not decoded, its messages are kept unchanged: {what}"))),
        };
        let stamp = schema.as_ref().and_then(|schema| schema.find("header.stamp").ok());
        let told = RosbagTopic {
            name: name.to_owned(),
            type_name: form.type_name.to_owned(),
            notes: note.into_iter().collect(),
            ..RosbagTopic::default()
        };
        let (joints, changed) = (Vec::new(), None);
        self.topics.push(Topic { channel, sequence: 0, schema, stamp, joints, changed, stamps: Vec::new(), logged: Vec::new(), told });
        Ok(self.topics.len() - 1)
    }

    /// Writes a message of a topic; `logged_ns` is when it was recorded.
    pub(crate) fn push(&mut self, topic: usize, logged_ns: i64, payload: &[u8]) -> Result<(), BagError> {
        let Some(topic) = self.topics.get_mut(topic) else { return Ok(()) };
        let stamp = match (&topic.schema, &topic.stamp) {
            (Some(schema), Some(path)) => schema.read_time_ns(path, payload).ok().flatten().unwrap_or(0),
            _ => 0,
        };
        if let Some(joints) = topic.schema.as_ref().filter(|_| topic.changed.is_none()).and_then(|schema| schema.joint_names(payload).ok())
        {
            match topic.joints.is_empty() {
                true => topic.joints = joints,
                false if joints.is_empty() || joints == topic.joints => {}
                false => topic.changed = Some(topic.told.messages + 1),
            }
        }
        let log_time = u64::try_from(logged_ns).unwrap_or(0);
        let publish_time = u64::try_from(stamp).ok().filter(|stamp| *stamp != 0).unwrap_or(log_time);
        let header = MessageHeader { channel_id: topic.channel, sequence: topic.sequence, log_time, publish_time };
        self.mcap.write_to_known_channel(&header, payload).map_err(failed(&self.path))?;
        topic.sequence = topic.sequence.wrapping_add(1);
        topic.told.messages += 1;
        topic.stamps.push(stamp);
        topic.logged.push(logged_ns);
        Ok(())
    }

    /// Ends the bag. One without a message is removed again, and its report has 0 messages.
    pub(crate) fn finish(mut self) -> Result<RosbagReport, BagError> {
        self.mcap.finish().map_err(failed(&self.path))?;
        if self.topics.iter().any(|topic| topic.told.messages > 0) {
            self.whole.commit()?;
        }
        let topics = self.topics.into_iter().map(|mut topic| {
            let times = if topic.stamps.iter().all(|stamp| *stamp != 0) { topic.stamps } else { topic.logged };
            let first = times.first().copied().unwrap_or(0);
            // Differences of whole ns: seconds since 1970 would leave only 0.2 us of a double.
            let times: Vec<f64> = times.iter().map(|time| time.wrapping_sub(first) as f64 / 1e9).collect();
            topic.told.clock = clock_remarks(&times);
            topic.told.notes.extend(topic.changed.map(|message| {
                let joint = topic.joints.first().map_or("", String::as_str);
                format!(
                    "message {message} has other joints than the first, or in another order: use names instead of numbers, as in \
                    position[{joint}]"
                )
            }));
            topic.told
        });
        let topics: Vec<RosbagTopic> = topics.collect();
        let messages = topics.iter().map(|topic| topic.messages).sum();
        Ok(RosbagReport { messages, topics, notes: Vec::new() })
    }
}

fn failed(path: &Path) -> impl Fn(mcap::McapError) -> BagError + use<> {
    let name = path.display().to_string();
    move |error| BagError::Write { name: name.clone(), what: reason(&error) }
}
