//! Writes a bag, on the caller's thread.

use crate::completeness::{COMPLETENESS, Completeness};
use crate::header::{BagHeader, Clock, RUN};
use crate::index::{self, COMPACT_INDEX, Index};
use crate::span::Spans;
use crate::steps::{Expected, STEPS_TOPIC};
use backdrive_msgs::Message;
use backdrive_msgs::ros::{self, RosError};
use mcap::records::{MessageHeader, Metadata};
use std::collections::BTreeMap;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Where a bag's bytes can go.
pub(crate) trait Store: Write + Seek + Send {}
impl<T: Write + Seek + Send> Store for T {}

/// How rosbag2 writes a quality of service down: keep the last 100, best effort, volatile, no deadlines.
const OFFERED_QOS: &str = "- history: 1\n  depth: 100\n  reliability: 2\n  durability: 2\n  deadline:\n    sec: 9223372036\n    nsec: 854775807\n  \
     lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    \
     nsec: 854775807\n  avoid_ros_namespace_conventions: false\n";

/// What keeps a message from being written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WriteError {
    #[error("{}", reason(.0))]
    Mcap(#[from] mcap::McapError),
    #[error("{0}")]
    Encode(#[from] RosError),
    #[error("the header cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// `mcap` reports only that there was an I/O error; the user needs to know which.
pub(crate) fn reason(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::Io(source) => source.to_string(),
        other => other.to_string(),
    }
}

/// The format options that all bags of ours share, of MCAP's indices all: lz4, because its worst stall is 0.3 ms where that of zstd is 60 ms. Chunks end where
/// the caller decides: no limit of size may separate a sample from its facts.
pub(crate) fn options() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .profile("ros2")
        .library(concat!("backdrive ", env!("CARGO_PKG_VERSION")))
        .compression(Some(mcap::Compression::Lz4))
        .compression_threads(0)
        .chunk_size(None)
}

/// Counts the bytes of a file while it grows.
struct Counted {
    store: Box<dyn Store>,
    position: u64,
    size: Arc<AtomicU64>,
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.store.write(bytes)?;
        self.position += written as u64;
        self.size.fetch_max(self.position, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.store.flush()
    }
}

impl Seek for Counted {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = self.store.seek(to)?;
        Ok(self.position)
    }
}

/// Metadata of a channel.
fn qos() -> BTreeMap<String, String> {
    BTreeMap::from([("offered_qos_profiles".to_owned(), OFFERED_QOS.to_owned())])
}

/// A bag being written.
pub(crate) struct BagWriter {
    mcap: mcap::Writer<BufWriter<Counted>>,
    clock: Clock,
    channels: Vec<ChannelState>,
    /// Channel of what samples have no field for, and messages on it.
    steps: (u16, u32),
    payload: Vec<u8>,
    /// Log times of the chunk at hand, and first and last of the bag.
    index: Index,
    spans: Spans,
    /// Bytes of the file so far.
    size: Arc<AtomicU64>,
    /// Size at which a chunk ends, and of the one at hand, bytes before compression.
    chunk_bytes: u64,
    in_chunk: u64,
}

struct ChannelState {
    id: u16,
    topic: String,
    axes: Vec<String>,
    written: u64,
    expected: Expected,
}

/// Bytes of a message record in its chunk, beside its payload.
const RECORD_BYTES: u64 = 31;

impl BagWriter {
    /// Writes everything that comes before the first message, so that a bag that is cut off later has it.
    pub(crate) fn new(store: Box<dyn Store>, header: &BagHeader, chunk_bytes: u64, size: Arc<AtomicU64>) -> Result<BagWriter, WriteError> {
        let sink = BufWriter::with_capacity(1 << 17, Counted { store, position: 0, size: size.clone() });
        // A chunk index without message indices would be worse than none: `@mcap/core`, which Foxglove reads with, then finds no message. Without
        // both it reads the file from its beginning, as the other readers do.
        let mut mcap = options().emit_message_indexes(false).emit_chunk_indexes(false).create(sink)?;
        let mut channels = Vec::with_capacity(header.topics.len());
        for info in &header.topics {
            let (name, text) = ros::schema(info.topic.kind);
            let schema = mcap.add_schema(name, "ros2msg", text.as_bytes())?;
            let id = mcap.add_channel(schema, &info.topic.name, "cdr", &qos())?;
            let (topic, axes) = (info.topic.name.clone(), info.axes.clone());
            channels.push(ChannelState { id, topic, axes, written: 0, expected: Expected::default() });
        }
        let schema = mcap.add_schema(ros::STEPS.0, "ros2msg", ros::STEPS.1.as_bytes())?;
        let steps = (mcap.add_channel(schema, STEPS_TOPIC, "cdr", &qos())?, 0);
        mcap.write_metadata(&Metadata { name: RUN.to_owned(), metadata: header.to_metadata()? })?;
        for (name, text) in &header.files {
            mcap.attach(&mcap::Attachment {
                log_time: 0,
                create_time: 0,
                name: name.clone(),
                media_type: if name.ends_with(".toml") { "application/toml" } else { "text/plain" }.to_owned(),
                data: text.as_bytes().into(),
            })?;
        }
        mcap.flush()?;
        let payload = Vec::with_capacity(1024);
        let (index, spans) = (Index::new(), Spans::default());
        Ok(BagWriter { mcap, clock: header.clock, channels, steps, payload, index, spans, size, chunk_bytes, in_chunk: 0 })
    }

    /// Writes one message. An index beyond the header's topics is ignored: the recorder has refused it before.
    pub(crate) fn write(&mut self, topic: usize, message: &Message, receive_ns: i64) -> Result<(), WriteError> {
        let Some(channel) = self.channels.get_mut(topic) else { return Ok(()) };
        let stamp = u64::try_from(message.stamp_ns()).unwrap_or(0);
        let log_time = match self.clock {
            Clock::Realtime => u64::try_from(receive_ns).unwrap_or(0),
            Clock::Lockstep | Clock::Imported => stamp,
        };
        if let Message::Sample(sample) = message
            && channel.expected.must_say(sample)
        {
            ros::encode_steps(&channel.topic, sample, &mut self.payload)?;
            let (channel_id, sequence) = self.steps;
            self.mcap.write_to_known_channel(&MessageHeader { channel_id, sequence, log_time, publish_time: stamp }, &self.payload)?;
            self.steps.1 = sequence.wrapping_add(1);
            self.index.entry(channel_id).or_default().push(log_time);
            self.in_chunk += RECORD_BYTES + self.payload.len() as u64;
        }
        ros::encode(message, &channel.axes, &mut self.payload)?;
        let header = MessageHeader { channel_id: channel.id, sequence: message.sequence() as u32, log_time, publish_time: stamp };
        self.mcap.write_to_known_channel(&header, &self.payload)?;
        channel.written += 1;
        self.index.entry(channel.id).or_default().push(log_time);
        self.spans.see(channel.id, log_time);
        self.in_chunk += RECORD_BYTES + self.payload.len() as u64;
        if self.in_chunk > self.chunk_bytes {
            self.flush()?;
        }
        Ok(())
    }

    /// Ends the chunk at hand and hands everything to the operating system: what is flushed survives the death of the process.
    pub(crate) fn flush(&mut self) -> Result<(), WriteError> {
        self.end_chunk()?;
        self.mcap.flush()?;
        self.in_chunk = 0;
        self.channels.iter_mut().for_each(|channel| channel.expected.forget());
        Ok(())
    }

    /// Ends the current chunk, and records its content.
    fn end_chunk(&mut self) -> Result<(), WriteError> {
        if self.in_chunk > 0 {
            self.mcap.write_private_record(COMPACT_INDEX, &index::encode(&self.index), Default::default())?;
            self.index.values_mut().for_each(Vec::clear);
        }
        Ok(())
    }

    /// Messages written per topic.
    pub(crate) fn written(&self) -> impl Iterator<Item = u64> + '_ {
        self.channels.iter().map(|channel| channel.written)
    }

    /// Writes the verdict and the summary.
    pub(crate) fn finish(&mut self, completeness: &Completeness) -> Result<(), WriteError> {
        self.end_chunk()?;
        self.mcap.flush()?;
        self.mcap.write_metadata(&self.spans.to_metadata(self.size.load(Ordering::Relaxed)))?;
        self.mcap.write_metadata(&completeness_record(completeness)?)?;
        self.mcap.finish()?;
        Ok(())
    }

    /// Gives the file up after an error, adding nothing to it.
    pub(crate) fn abandon(self) {
        drop(self.mcap.into_inner());
    }
}

/// The verdict as a metadata record.
pub(crate) fn completeness_record(completeness: &Completeness) -> Result<Metadata, serde_json::Error> {
    let metadata = BTreeMap::from([
        ("complete".to_owned(), completeness.is_complete().to_string()),
        ("lost".to_owned(), completeness.lost().to_string()),
        ("verdict".to_owned(), serde_json::to_string(completeness)?),
    ]);
    Ok(Metadata { name: COMPLETENESS.to_owned(), metadata })
}
