//! Saves what a killed recorder, a full disk or a broken copy left behind.

use crate::claim::{claim, not_itself};
use crate::completeness::{COMPLETENESS, Completeness, Tracker};
use crate::framing::{Frame, Frames};
use crate::header::{BagHeader, RUN};
use crate::reader::{Channels, parse, records, salvage};
use crate::writer::{completeness_record, options, reason};
use crate::{BagError, Reader};
use backdrive_msgs::ros;
use backdrive_msgs::topic::Kind;
use mcap::records::{Record, op};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

impl RecoverReport {
    /// Whether anything is known, or must be feared, to be missing in the copy.
    pub fn is_lossy(&self) -> bool {
        let short = self.expected.is_some_and(|expected| expected > self.messages);
        !self.was_clean || short || !self.damaged.is_empty() || self.completeness.as_ref().is_some_and(|verdict| verdict.lost() > 0)
    }
}

/// What could be saved.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RecoverReport {
    /// Messages in the copy.
    pub messages: u64,
    /// Log time of the last of them, s.
    pub last_log_time_s: Option<f64>,
    /// Highest step of any of them, if they have steps.
    pub last_step: Option<u64>,
    /// Attachments and metadata records in the copy.
    pub attachments: u64,
    /// Whether the file had been closed: then there was nothing to save.
    pub was_clean: bool,
    /// Records or chunks that are damaged, with their place.
    pub damaged: Vec<String>,
    /// Messages in the copy that stand in a damaged chunk: they are where its index says and decode as their type says, but no
    /// checksum vouches for their values.
    pub unconfirmed: u64,
    /// Messages that the file held when it was whole, where its statistics or the indices of its chunks tell.
    pub expected: Option<u64>,
    /// Messages of damaged chunks that could not be saved, per topic, as far as the chunks' indices tell.
    pub missing: BTreeMap<String, u64>,
    /// The verdict in the copy, for bags of ours.
    pub completeness: Option<Completeness>,
}

/// Copies everything that is whole into a clean bag.
///
/// Of a bag that was cut off the chunk that was open is lost, and of it the messages that had not reached the file. Of a damaged
/// chunk those messages are saved that can still be read, stand where the chunk's index says, and hold what their type says.
/// Errors: `from` cannot be read or is no MCAP file, `to` exists (unless it may be replaced), is being written, or cannot be.
pub fn recover(from: &Path, to: &Path, overwrite: bool) -> Result<RecoverReport, BagError> {
    not_itself(from, to)?;
    let mut frames = Frames::open(from)?;
    let file = claim(to, overwrite)?;
    let copied = copy(from, &mut frames, to, file);
    if copied.is_err() {
        // Half a copy would only be mistaken for a whole one.
        let _ = std::fs::remove_file(to);
    }
    copied
}

fn copy(from: &Path, frames: &mut Frames, to: &Path, file: File) -> Result<RecoverReport, BagError> {
    let failed = |error: mcap::McapError| BagError::Write { name: to.display().to_string(), what: reason(&error) };
    let mut copy = Copy {
        from,
        begun: Begun::Not(file),
        found: Channels::default(),
        kinds: HashMap::new(),
        trackers: BTreeMap::new(),
        run: false,
        report: RecoverReport::default(),
    };
    let statistics = copy.look_ahead(from)?;
    let (mut last, mut ahead) = (None::<u64>, None);
    while let Some(frame) = match ahead.take() {
        Some(frame) => Some(frame),
        None => frames.next()?,
    } {
        if frame.opcode == op::DATA_END {
            break; // what follows is the summary, which the copy makes anew
        }
        let wanted =
            matches!(frame.opcode, op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::ATTACHMENT | op::METADATA);
        if !wanted || frame.cut && frame.opcode != op::CHUNK {
            continue;
        }
        let body = frames.body(&frame)?;
        let (mut whole, error) = records(from, &frame, &body);
        if let Some(error) = error {
            copy.report.damaged.push(error.to_string());
            if frame.opcode == op::CHUNK {
                let index;
                (index, ahead) = index_behind(from, frames)?;
                whole = copy.believable(salvage(from, &frame, &body), index);
            }
        }
        for record in whole {
            if let Record::Message { header, .. } = &record {
                last = Some(last.map_or(header.log_time, |last| last.max(header.log_time)));
            }
            copy.take(record, frame.offset).map_err(failed)?;
        }
    }
    // Only a walk to the very end tells whether the file was closed.
    while frames.next()?.is_some() {}
    // Topics on which nothing was said are topics of the bag too.
    for id in copy.found.channels.keys().copied().collect::<Vec<_>>() {
        copy.channel(id).map_err(failed)?;
    }
    let Copy { mut begun, trackers, run, mut report, .. } = copy;
    report.was_clean = frames.closed;
    report.last_log_time_s = last.map(|time| time as f64 * 1e-9);
    report.last_step = trackers.values().filter_map(|tracker| tracker.found.last_step).max();
    let known = report.missing.values().sum::<u64>();
    report.expected = statistics.filter(|_| report.was_clean).or((known > 0).then_some(report.messages + known));
    let out = begun.writer("", "").map_err(failed)?;
    if run {
        // A verdict of the recorder knows more than the sequence numbers tell, if the bag got as far.
        let told = Reader::open(from).ok().and_then(|reader| reader.completeness().cloned());
        let verdict = match told {
            Some(told) if report.damaged.is_empty() => told,
            told => {
                let mut topics: Vec<_> = trackers.into_values().map(|tracker| tracker.found).collect();
                for topic in &mut topics {
                    let told = told.iter().flat_map(|told| &told.topics).find(|told| told.topic == topic.topic);
                    topic.lost = told.map_or(topic.lost, |told| topic.lost.max((told.written + told.lost).saturating_sub(topic.written)));
                }
                Completeness { topics, late: 0, recovered: true }
            }
        };
        let record =
            completeness_record(&verdict).map_err(|error| BagError::Write { name: to.display().to_string(), what: error.to_string() })?;
        out.write_metadata(&record).map_err(failed)?;
        report.completeness = Some(verdict);
    }
    out.finish().map_err(failed)?;
    Ok(report)
}

/// Of a chunk: the log time of a message by channel and place in the chunk.
type Index = BTreeMap<u16, Vec<u64>>;

/// The indices that stand behind a chunk, and the record after them.
fn index_behind(from: &Path, frames: &mut Frames) -> Result<(Index, Option<Frame>), BagError> {
    let mut index = Index::new();
    while let Some(frame) = frames.next()? {
        if frame.opcode != op::MESSAGE_INDEX || frame.cut {
            return Ok((index, Some(frame)));
        }
        let body = frames.body(&frame)?;
        if let Ok(Record::MessageIndex(found)) = parse(from, &frame, &body) {
            index.entry(found.channel_id).or_default().extend(found.records.iter().map(|entry| entry.log_time));
        }
    }
    Ok((index, None))
}

/// A file that becomes a bag with the header of the original, as soon as that is known.
enum Begun {
    Not(File),
    Yes(Box<mcap::Writer<BufWriter<File>>>),
    Failed,
}

impl Begun {
    fn writer(&mut self, profile: &str, library: &str) -> mcap::McapResult<&mut mcap::Writer<BufWriter<File>>> {
        *self = match std::mem::replace(self, Begun::Failed) {
            Begun::Not(file) => Begun::Yes(Box::new(options(1 << 20).profile(profile).library(library).create(BufWriter::new(file))?)),
            begun => begun,
        };
        match self {
            Begun::Yes(out) => Ok(out),
            Begun::Not(_) | Begun::Failed => Err(mcap::McapError::AttemptedWriteAfterFailure),
        }
    }
}

/// A copy in the making.
struct Copy<'a> {
    from: &'a Path,
    begun: Begun,
    found: Channels,
    /// Channels in the copy, and the kind of those that are ours.
    kinds: HashMap<u16, Option<Kind>>,
    trackers: BTreeMap<u16, Tracker>,
    run: bool,
    report: RecoverReport,
}

impl Copy<'_> {
    /// Reads the channels of the summary, which outlive a damaged chunk that described them, and how many messages there were.
    fn look_ahead(&mut self, from: &Path) -> Result<Option<u64>, BagError> {
        let (mut frames, mut in_summary, mut messages) = (Frames::open(from)?, false, None);
        while let Some(frame) = frames.next()? {
            in_summary |= frame.opcode == op::DATA_END;
            if !in_summary || frame.cut || !matches!(frame.opcode, op::SCHEMA | op::CHANNEL | op::STATISTICS) {
                continue;
            }
            let body = frames.body(&frame)?;
            match parse(from, &frame, &body) {
                Ok(Record::Statistics(found)) => messages = Some(found.message_count),
                Ok(record) => self.found.see(record.into_owned()),
                Err(_) => {}
            }
        }
        Ok(messages)
    }

    /// Of what can be read in a damaged chunk: the messages of which the chunk's index knows, in the index' order, and that
    /// hold what their type says. The others are counted as missing.
    fn believable(&mut self, read: Vec<Record<'static>>, index: Index) -> Vec<Record<'static>> {
        let mut left: BTreeMap<u16, std::collections::VecDeque<u64>> =
            index.into_iter().map(|(channel, times)| (channel, times.into())).collect();
        let mut kept = Vec::new();
        for record in read {
            let Record::Message { header, data } = &record else {
                self.found.see(record);
                continue;
            };
            let Some(times) = left.get_mut(&header.channel_id) else { continue };
            let Some(place) = times.iter().position(|time| *time == header.log_time) else { continue };
            let kind = self
                .found
                .channels
                .get(&header.channel_id)
                .and_then(|c| self.found.schemas.get(&c.schema_id))
                .and_then(|s| ros::kind_of(&s.0));
            let fits = match kind.map(|kind| ros::decode(kind, data)) {
                Some(Ok(message)) => {
                    message.sequence() as u32 == header.sequence && u64::try_from(message.stamp_ns()).unwrap_or(0) == header.publish_time
                }
                Some(Err(ros::RosError::Foreign { .. })) | None => true,
                Some(Err(_)) => false,
            };
            if fits {
                times.remove(place);
                self.report.unconfirmed += 1;
                kept.push(record);
            }
        }
        for (channel, times) in left.iter().filter(|(_, times)| !times.is_empty()) {
            let name = self.found.channels.get(channel).map_or_else(|| format!("channel {channel}"), |channel| channel.topic.clone());
            *self.report.missing.entry(name).or_default() += times.len() as u64;
        }
        kept
    }

    fn take(&mut self, record: Record, offset: u64) -> mcap::McapResult<()> {
        match record {
            Record::Header(header) => {
                self.begun.writer(&header.profile, &header.library)?;
            }
            Record::Message { header, data } => {
                let Some(kind) = self.channel(header.channel_id)? else {
                    let what = format!("byte {offset}: a message of channel {}, which was never described", header.channel_id);
                    self.report.damaged.push(what);
                    return Ok(());
                };
                self.begun.writer("", "")?.write_to_known_channel(&header, &data)?;
                self.report.messages += 1;
                if let Some(kind) = kind
                    && let Some(tracker) = self.trackers.get_mut(&header.channel_id)
                    && let Ok(message) = ros::decode(kind, &data)
                {
                    tracker.see(&message);
                }
            }
            Record::Attachment { header, data, .. } => {
                let (log_time, create_time, name, media_type) = (header.log_time, header.create_time, header.name, header.media_type);
                self.begun.writer("", "")?.attach(&mcap::Attachment { log_time, create_time, name, media_type, data })?;
                self.report.attachments += 1;
            }
            Record::Metadata(metadata) if metadata.name == COMPLETENESS => {}
            Record::Metadata(metadata) => {
                if metadata.name == RUN {
                    // Metadata has no checksum: what cannot be read must not be handed on as if it were whole.
                    if let Err(error) = BagHeader::from_metadata(self.from, &metadata.metadata, |_| None) {
                        self.report.damaged.push(error.to_string());
                        return Ok(());
                    }
                    self.run = true;
                }
                self.begun.writer("", "")?.write_metadata(&metadata)?;
                self.report.attachments += 1;
            }
            record => self.found.see(record),
        }
        Ok(())
    }

    /// Sees to it that the copy has a channel, under the number it has in the original; `None` if that never described it.
    fn channel(&mut self, id: u16) -> mcap::McapResult<Option<Option<Kind>>> {
        if let Some(kind) = self.kinds.get(&id) {
            return Ok(Some(*kind));
        }
        let Some(channel) = self.found.channels.get(&id) else { return Ok(None) };
        let schema = self.found.schemas.get(&channel.schema_id).filter(|_| channel.schema_id != 0); // 0 means none
        let out = self.begun.writer("", "")?;
        let mut schema_id = 0;
        if let Some((name, encoding, text)) = schema {
            schema_id = out.add_schema_with_id(channel.schema_id, name, encoding, text)?;
        }
        out.add_channel_with_id(id, schema_id, &channel.topic, &channel.message_encoding, &channel.metadata)?;
        let kind = schema.and_then(|(name, ..)| ros::kind_of(name));
        self.kinds.insert(id, kind);
        if kind.is_some() {
            self.trackers.insert(id, Tracker::new(&channel.topic));
        }
        Ok(Some(kind))
    }
}
