//! Reads any MCAP file, whoever wrote it and however it ended.

use crate::BagError;
use crate::cdr::Schema;
use crate::completeness::{COMPLETENESS, Completeness};
use crate::framing::{Frame, Frames};
use crate::header::{BagHeader, RUN};
use crate::steps::Said;
use backdrive_msgs::Message;
use backdrive_msgs::ros::{self, Facts};
use backdrive_msgs::topic::Kind;
use mcap::records::{MessageHeader, Metadata, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct TopicRef {
    /// Its place in [`Reader::topics`].
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
    /// Names of its axes, if the run's header tells them.
    pub axes: Vec<String>,
    /// Metadata of its channel.
    pub metadata: BTreeMap<String, String>,
}

impl TopicRef {
    /// Its schema, for reading fields by name.
    ///
    /// Errors: it is no ros2msg CDR topic, or the schema cannot be parsed.
    pub fn parse_schema(&self) -> Result<Schema, BagError> {
        let wrong = |what: String| BagError::Field { topic: self.name.clone(), field: String::new(), what };
        if self.encoding != "cdr" || self.schema_encoding != "ros2msg" {
            return Err(wrong(format!(
                "messages are {:?} with a {:?} schema; fields can be read of \"cdr\" with \"ros2msg\"",
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
    /// What the bag says of it beside its bytes, if it is a sample of ours.
    pub facts: Option<Facts>,
}

impl Entry {
    /// The message, if its topic is one of ours; `None` for other people's types, and for their JointStates.
    ///
    /// Errors: the payload does not hold what its topic says.
    pub fn message(&self, path: &Path) -> Result<Option<Message>, BagError> {
        let Some(kind) = self.topic.kind else { return Ok(None) };
        match decode(kind, self.facts.as_ref(), &self.payload) {
            Ok(message) => Ok(Some(message)),
            Err(ros::RosError::Foreign { .. }) => Ok(None),
            Err(source) => Err(BagError::Message { path: path.to_owned(), offset: self.offset, topic: self.topic.name.clone(), source }),
        }
    }
}

/// Reads a payload, with what the bag says of it beside.
pub(crate) fn decode(kind: Kind, facts: Option<&Facts>, payload: &[u8]) -> Result<Message, ros::RosError> {
    match facts {
        Some(facts) if kind == Kind::Sample => ros::decode_sample(payload, facts).map(Message::Sample),
        _ => ros::decode(kind, payload),
    }
}

/// A bag that is open for reading.
#[derive(Debug, Clone)]
pub struct Reader {
    path: PathBuf,
    profile: String,
    library: String,
    topics: Vec<Arc<TopicRef>>,
    /// Channels on which it is said which step samples are of.
    steps: Vec<u16>,
    counts: Vec<u64>,
    header: Option<BagHeader>,
    completeness: Option<Completeness>,
    damage: Vec<String>,
    closed: bool,
    bytes: u64,
}

impl Reader {
    /// Opens a bag: reads what it says about itself. A bag that was cut off is walked through once.
    ///
    /// What is damaged there is left out and told by [`Reader::damage`]: the messages can be read all the same.
    /// Errors: it cannot be read or is no MCAP file.
    pub fn open(path: &Path) -> Result<Reader, BagError> {
        let bytes = std::fs::metadata(path).map_err(BagError::io(path))?.len();
        let mut frames = Frames::open(path)?;
        let (mut profile, mut library) = (String::new(), String::new());
        let mut found = Channels::default();
        let (mut in_summary, mut summary_has_channels) = (false, false);
        let (mut metadata, mut attachments, mut statistics) = (Vec::new(), HashMap::new(), None);
        let mut damage = Vec::new();
        while let Some(frame) = frames.next()? {
            if frame.opcode == op::DATA_END {
                in_summary = true;
            }
            if frame.cut || !matches!(frame.opcode, op::HEADER | op::SCHEMA | op::CHANNEL | op::METADATA | op::ATTACHMENT | op::STATISTICS)
            {
                continue;
            }
            let body = frames.body(&frame)?;
            let record = match parse(path, &frame, &body) {
                Ok(record) => record,
                Err(error) => {
                    damage.push(error.to_string());
                    continue;
                }
            };
            match record {
                Record::Header(header) => (profile, library) = (header.profile, header.library),
                Record::Statistics(found) => statistics = Some(found),
                Record::Metadata(record) => metadata.push(record),
                Record::Attachment { header, data, .. } => {
                    attachments.insert(header.name, String::from_utf8_lossy(&data).into_owned());
                }
                record => {
                    summary_has_channels |= in_summary && matches!(record, Record::Channel(_));
                    found.see(record);
                }
            }
        }
        let closed = frames.closed;
        let header = last(&metadata, RUN)
            .map(|record| BagHeader::from_metadata(path, &record.metadata, |name| attachments.get(name).cloned()))
            .and_then(|header| header.map_err(|error| damage.push(error.to_string())).ok());
        let completeness = last(&metadata, COMPLETENESS)
            .map(|record| verdict(path, record))
            .and_then(|verdict| verdict.map_err(|error| damage.push(error.to_string())).ok());
        let mut counts = HashMap::new();
        if closed && summary_has_channels && statistics.is_some() {
            counts.extend(statistics.into_iter().flat_map(|statistics| statistics.channel_message_counts));
        } else {
            // Channels may stand inside the chunks only.
            let mut frames = Frames::open(path)?;
            while let Some(frame) = frames.next()? {
                if !matches!(frame.opcode, op::CHUNK | op::MESSAGE | op::SCHEMA | op::CHANNEL) {
                    continue;
                }
                let body = frames.body(&frame)?;
                for record in records(path, &frame, &body).0 {
                    if let Record::Message { header, .. } = &record {
                        *counts.entry(header.channel_id).or_insert(0) += 1;
                    }
                    found.see(record);
                }
            }
        }
        let steps = found.steps();
        let topics = found.topics(header.as_ref());
        Ok(Reader {
            path: path.to_owned(),
            profile,
            library,
            counts: topics.iter().map(|topic| counts.get(&topic.channel).copied().unwrap_or(0)).collect(),
            topics,
            steps,
            header,
            completeness,
            damage,
            closed,
            bytes,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Every topic, in the order of the run's header if there is one, then by channel; without that on which a bag of ours says
    /// which step samples are of, for which see [`Entry::facts`].
    pub fn topics(&self) -> &[Arc<TopicRef>] {
        &self.topics
    }

    /// Messages per topic, in the order of [`Reader::topics`].
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// What backdrive wrote about the run; `None` in other people's bags.
    pub fn header(&self) -> Option<&BagHeader> {
        self.header.as_ref()
    }

    /// The recorder's verdict; `None` in other people's bags, and when the recorder did not finish.
    pub fn completeness(&self) -> Option<&Completeness> {
        self.completeness.as_ref()
    }

    /// What could not be read of the bag's description of itself, with its place.
    pub fn damage(&self) -> &[String] {
        &self.damage
    }

    /// Whether the writer closed the file.
    pub fn ended_cleanly(&self) -> bool {
        self.closed
    }

    /// Profile of the file, such as `ros2`.
    pub fn profile(&self) -> &str {
        &self.profile
    }

    /// Who wrote it.
    pub fn library(&self) -> &str {
        &self.library
    }

    /// Size of the file, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// A topic by its name.
    ///
    /// Errors: there is none; the error lists those that there are.
    pub fn topic(&self, name: &str) -> Result<&Arc<TopicRef>, BagError> {
        self.topics.iter().find(|topic| topic.name == name).ok_or_else(|| BagError::NoTopic {
            path: self.path.clone(),
            topic: name.to_owned(),
            available: self.topics.iter().map(|topic| topic.name.clone()).collect(),
        })
    }

    /// Every message in the order of the file.
    ///
    /// A bag that was cut off ends with its last whole message, without an error: [`Reader::ended_cleanly`] tells.
    /// Damage before the end is an error with its place, and the iteration ends there.
    pub fn messages(&self) -> Result<Messages, BagError> {
        let topics = self.topics.iter().map(|topic| (topic.channel, topic.clone())).collect();
        Ok(Messages {
            path: self.path.clone(),
            frames: Frames::open(&self.path)?,
            topics,
            steps: self.steps.clone(),
            said: Said::default(),
            pending: VecDeque::new(),
            offset: 0,
            done: false,
        })
    }
}

/// See [`Reader::messages`].
pub struct Messages {
    path: PathBuf,
    frames: Frames,
    topics: HashMap<u16, Arc<TopicRef>>,
    steps: Vec<u16>,
    said: Said,
    pending: VecDeque<(MessageHeader, Vec<u8>)>,
    offset: u64,
    done: bool,
}

impl Messages {
    fn advance(&mut self) -> Result<Option<Entry>, BagError> {
        loop {
            if let Some((header, payload)) = self.pending.pop_front() {
                if self.steps.contains(&header.channel_id) {
                    self.said.hear(&self.path, self.offset, &payload)?;
                    continue;
                }
                let Some(topic) = self.topics.get(&header.channel_id) else {
                    let what = format!("a message of channel {}, which was never described", header.channel_id);
                    return Err(BagError::Damaged { path: self.path.clone(), offset: self.offset, what });
                };
                return Ok(Some(Entry {
                    topic: topic.clone(),
                    sequence: header.sequence,
                    log_time_ns: header.log_time,
                    publish_time_ns: header.publish_time,
                    offset: self.offset,
                    payload,
                    facts: if topic.kind == Some(Kind::Sample) { self.said.of(&topic.name, header.sequence) } else { None },
                }));
            }
            let Some(frame) = self.frames.next()? else { return Ok(None) };
            if !matches!(frame.opcode, op::CHUNK | op::MESSAGE) {
                continue;
            }
            let body = self.frames.body(&frame)?;
            self.offset = frame.offset;
            let (records, error) = records(&self.path, &frame, &body);
            if let Some(error) = error {
                return Err(error);
            }
            self.pending.extend(records.into_iter().filter_map(|record| match record {
                Record::Message { header, data } => Some((header, data.into_owned())),
                _ => None,
            }));
        }
    }
}

impl Iterator for Messages {
    type Item = Result<Entry, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.done {
            return None;
        }
        let next = self.advance().transpose();
        self.done = !matches!(next, Some(Ok(_)));
        next
    }
}

/// Schemas and channels as they turn up.
#[derive(Default)]
pub(crate) struct Channels {
    pub(crate) schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    pub(crate) channels: BTreeMap<u16, mcap::records::Channel>,
}

impl Channels {
    /// Takes notice of a schema or a channel; the first of a number counts.
    pub(crate) fn see(&mut self, record: Record) {
        match record {
            Record::Schema { header, data } => {
                self.schemas.entry(header.id).or_insert_with(|| (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            _ => {}
        }
    }

    /// Whether a channel says which step samples are of.
    pub(crate) fn says_steps(&self, channel: &mcap::records::Channel) -> bool {
        channel.message_encoding == "cdr" && self.schemas.get(&channel.schema_id).is_some_and(|schema| schema.0 == ros::STEPS.0)
    }

    /// The channels that say which step samples are of.
    pub(crate) fn steps(&self) -> Vec<u16> {
        self.channels.values().filter(|channel| self.says_steps(channel)).map(|channel| channel.id).collect()
    }

    fn topics(mut self, run: Option<&BagHeader>) -> Vec<Arc<TopicRef>> {
        for steps in self.steps() {
            self.channels.remove(&steps);
        }
        let place = |name: &str| run.and_then(|run| run.topic(name));
        let mut channels: Vec<_> = self.channels.into_values().collect();
        channels.sort_by_key(|channel| (place(&channel.topic).unwrap_or(usize::MAX), channel.id));
        let refer = |(index, channel): (usize, mcap::records::Channel)| {
            let (type_name, schema_encoding, schema) = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
            let axes = place(&channel.topic).and_then(|place| run.map(|run| run.topics[place].axes.clone())).unwrap_or_default();
            let kind = if channel.message_encoding == "cdr" { ros::kind_of(&type_name) } else { None };
            Arc::new(TopicRef {
                index,
                channel: channel.id,
                kind,
                type_name,
                encoding: channel.message_encoding,
                schema_encoding,
                schema,
                axes,
                name: channel.topic,
                metadata: channel.metadata,
            })
        };
        channels.into_iter().enumerate().map(refer).collect()
    }
}

fn last<'a>(metadata: &'a [Metadata], name: &str) -> Option<&'a Metadata> {
    metadata.iter().rev().find(|record| record.name == name)
}

fn verdict(path: &Path, record: &Metadata) -> Result<Completeness, BagError> {
    let wrong = |what: String| BagError::Metadata { path: path.to_owned(), record: COMPLETENESS, key: "verdict", what };
    let text = record.metadata.get("verdict").ok_or_else(|| wrong("is missing".to_owned()))?;
    serde_json::from_str(text).map_err(|error| wrong(error.to_string()))
}

/// Parses the body of a record that is whole.
pub(crate) fn parse<'a>(path: &Path, frame: &Frame, body: &'a [u8]) -> Result<Record<'a>, BagError> {
    let damaged = |what: String| BagError::Damaged { path: path.to_owned(), offset: frame.offset, what };
    // mcap 0.26 slices an attachment without looking at its length first.
    if frame.opcode == op::ATTACHMENT && attachment_header_len(body).is_none_or(|len| len + 4 > body.len()) {
        return Err(damaged(format!("an attachment record of {} bytes is too short for its own header", body.len())));
    }
    mcap::read::parse_record(frame.opcode, body)
        .map_err(|error| damaged(format!("record of type 0x{:02x}, {} bytes: {}", frame.opcode, body.len(), crate::writer::reason(&error))))
}

/// Two times, two counted strings, the length of the data.
fn attachment_header_len(body: &[u8]) -> Option<usize> {
    let mut at = 16;
    for _ in 0..2 {
        at += 4 + u32_at(body, at)? as usize;
    }
    Some(at + 8)
}

fn u32_at(body: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(body.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

fn u64_at(body: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(body.get(at..at.checked_add(8)?)?.try_into().ok()?))
}

/// The schemas, channels and messages of a record outside or of all records inside a chunk.
///
/// Of a chunk that the file's end cuts off: those that are whole, and no error. Of a chunk that is damaged: none, and the error.
pub(crate) fn records(path: &Path, frame: &Frame, body: &[u8]) -> (Vec<Record<'static>>, Option<BagError>) {
    read_records(path, frame, body, true)
}

/// What can still be read inside a damaged chunk, its checksum aside: all records before the first that breaks off, those left
/// out that cannot be parsed. Nothing of it can be believed without a second witness.
pub(crate) fn salvage(path: &Path, frame: &Frame, body: &[u8]) -> Vec<Record<'static>> {
    read_records(path, frame, body, false).0
}

fn read_records(path: &Path, frame: &Frame, body: &[u8], strict: bool) -> (Vec<Record<'static>>, Option<BagError>) {
    if frame.opcode != op::CHUNK {
        if frame.cut {
            return (Vec::new(), None);
        }
        return match parse(path, frame, body) {
            Ok(record) => (vec![record.into_owned()], None),
            Err(error) => (Vec::new(), Some(error)),
        };
    }
    let damaged = |what: String| BagError::Damaged { path: path.to_owned(), offset: frame.offset, what };
    let Some((head, data)) = chunk_head(body, frame.cut) else {
        let error = (!frame.cut).then(|| damaged(format!("a chunk record of {} bytes is too short for its own header", body.len())));
        return (Vec::new(), error);
    };
    // Of a whole chunk the checksum is verified before anything in it is believed: lengths in a damaged one ask for any amount of memory.
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(strict && !frame.cut)
        .with_prevalidate_chunk_crcs(strict && !frame.cut)
        .with_record_length_limit(if strict { LARGEST_CHUNK } else { body.len().saturating_mul(256).min(LARGEST_CHUNK) });
    let (mut reader, mut source) = (LinearReader::new_with_options(options), head.chain(data));
    let mut found = Vec::new();
    while let Some(event) = reader.next_event() {
        let error = match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let room = reader.insert(wanted.min(head.len() + data.len()));
                match source.read(room) {
                    Ok(len) => {
                        reader.notify_read(len);
                        continue;
                    }
                    Err(error) => damaged(error.to_string()),
                }
            }
            Ok(LinearReadEvent::Record { opcode, data }) => match parse(path, &Frame { opcode, ..*frame }, data) {
                Ok(record) => {
                    found.push(record.into_owned());
                    continue;
                }
                Err(_) if !strict => continue,
                Err(error) => error,
            },
            Err(error) => damaged(format!("chunk: {}", crate::writer::reason(&error))),
        };
        return if frame.cut || !strict { (found, None) } else { (Vec::new(), Some(error)) };
    }
    (found, None)
}

/// Uncompressed, bytes. Chunks are around 1 MB; what claims to be larger than this is damaged.
const LARGEST_CHUNK: usize = 1 << 29;

/// A chunk record up to its data, and the data. One that is cut off has as much data as there is, and no checksum.
fn chunk_head(body: &[u8], cut: bool) -> Option<(Vec<u8>, &[u8])> {
    let after_name = 32_usize.checked_add(u32_at(body, 28)? as usize)?;
    let compressed_size = u64_at(body, after_name)?;
    let (head, data) = body.split_at_checked(after_name + 8)?;
    let mut record = vec![op::CHUNK];
    record.extend((body.len() as u64).to_le_bytes());
    record.extend(head);
    if cut {
        let len = record.len();
        record[len - 8..].copy_from_slice(&(data.len() as u64).to_le_bytes());
        record[9 + 24..9 + 28].fill(0);
    } else if compressed_size > data.len() as u64 {
        return None;
    }
    Some((record, data))
}
