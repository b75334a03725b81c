//! Saves what a killed recorder, a full disk or a broken copy left behind.

use crate::account::{Account, Fault};
use crate::claim::not_itself;
use crate::completeness::{COMPLETENESS, Completeness, TopicCompleteness, Tracker};
use crate::framing::{Frame, Frames};
use crate::header::{BagHeader, RUN};
use crate::index::{COMPACT_INDEX, Index, decode as decode_index};
use crate::reader::channels::Channels;
use crate::reader::entry::decode;
use crate::reader::records::{parse, records, salvage};
use crate::span::SPANS;
use crate::steps::Said;
use crate::whole::Whole;
use crate::writer::{completeness_record, options, reason};
use crate::{BagError, Reader};
use backdrive_msgs::Message;
use backdrive_msgs::ros;
use backdrive_msgs::topic::Kind;
use mcap::records::{MessageHeader, Record, Statistics, op};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

impl RecoverReport {
    /// Whether anything is known, or must be feared, to be missing in the copy.
    pub fn is_lossy(&self) -> bool {
        let short = self.expected.is_some_and(|expected| expected > self.messages);
        let lost = self.completeness.as_ref().is_some_and(|verdict| verdict.lost() > 0);
        !self.was_clean || short || !self.damaged.is_empty() || lost || !self.faults.is_empty()
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
    /// Messages in the copy from a damaged chunk: they are at the place in its index and decode by their type, but no checksum confirms their values.
    pub unconfirmed: u64,
    /// Messages that the file held when it was whole, where its statistics or the indices of its chunks contain this.
    pub expected: Option<u64>,
    /// Messages of damaged chunks that could not be saved, per topic, where the chunks' indices contain them.
    pub missing: BTreeMap<String, u64>,
    /// The verdict in the copy, for bags of ours.
    pub completeness: Option<Completeness>,
    /// What forbids calling the copy whole, by its messages.
    pub faults: Vec<Fault>,
}

/// Copies everything that is whole into a clean bag, which has all of MCAP's indices: so this is the way to a bag in which a player can jump, too.
///
/// Of a bag that was cut off the chunk that was open is lost, and of it the messages that had not reached the file. Of a damaged chunk those messages
/// are saved that can still be read, are at the place in the chunk's index, and have the content of their type. Errors: `from` cannot be read or is
/// no MCAP file, `to` exists (unless it may be replaced), is being written, or cannot be.
pub fn recover(from: &Path, to: &Path, overwrite: bool) -> Result<RecoverReport, BagError> {
    not_itself(from, to)?;
    let mut frames = Frames::open(from)?;
    // Half a copy would only be mistaken for a whole one.
    let whole = Whole::begin(to, overwrite)?;
    let report = copy(from, &mut frames, to, whole.file()?)?;
    whole.commit()?;
    // The same question as every other verb asks of it.
    let faults = Account::of(&Reader::open(to)?)?.faults;
    Ok(RecoverReport { faults, ..report })
}

fn copy(from: &Path, frames: &mut Frames, to: &Path, file: File) -> Result<RecoverReport, BagError> {
    let failed = |error: mcap::McapError| BagError::Write { name: to.display().to_string(), what: reason(&error) };
    let mut copy = Copy {
        from,
        begun: Begun::Not(file),
        found: Channels::default(),
        carried: HashMap::new(),
        trackers: BTreeMap::new(),
        said: Said::default(),
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
        let (body, damaged) = (frames.body(&frame)?, copy.report.damaged.len());
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
        if frame.opcode == op::CHUNK {
            // Chunks of ours can be read each by itself, and those of the copy are the same.
            copy.begun.end_chunk().map_err(failed)?;
            if copy.report.damaged.len() > damaged {
                copy.said.forget();
            }
        }
    }
    // Only a walk to the very end shows whether the file was closed.
    while frames.next()?.is_some() {}
    // Topics without messages are topics of the bag too.
    for id in copy.found.channels.keys().copied().collect::<Vec<_>>() {
        copy.channel(id).map_err(failed)?;
    }
    let Copy { mut begun, trackers, run, mut report, found, .. } = copy;
    let steps = found.steps();
    let counted = |statistics: Statistics| {
        let of_steps = |channel: &u16| statistics.channel_message_counts.get(channel).copied().unwrap_or(0);
        statistics.message_count.saturating_sub(steps.iter().map(of_steps).sum())
    };
    report.was_clean = frames.closed;
    report.last_log_time_s = last.map(|time| time as f64 * 1e-9);
    report.last_step = trackers.values().filter_map(|tracker| tracker.found.last_step).max();
    let known = report.missing.values().sum::<u64>();
    report.expected = statistics.filter(|_| report.was_clean).map(counted).or((known > 0).then_some(report.messages + known));
    let out = begun.writer("", "").map_err(failed)?;
    if run {
        // A verdict of the recorder contains more than the sequence numbers, if the bag got as far.
        let original = Reader::open(from).ok();
        let told = original.as_ref().and_then(|reader| reader.completeness().cloned());
        // Of a bag that another program rewrote without the record, a comparison of the topics shows what is missing at their ends.
        let uncounted = original.filter(|_| told.is_none() && report.was_clean && report.damaged.is_empty());
        let faults = uncounted.and_then(|reader| Account::of(&reader).ok()).map(|account| account.faults).unwrap_or_default();
        let verdict = match told {
            Some(told) if report.damaged.is_empty() => told,
            told => {
                let mut topics: Vec<_> = trackers.into_values().map(|tracker| tracker.found).collect();
                for topic in &mut topics {
                    let told = told.iter().flat_map(|told| &told.topics).find(|told| told.topic == topic.topic);
                    topic.lost = told.map_or(topic.lost, |told| topic.lost.max((told.written + told.lost).saturating_sub(topic.written)));
                }
                for fault in faults {
                    let Fault::Lost { topic, messages, .. } = fault else { continue };
                    match topics.iter_mut().find(|found| found.topic == topic) {
                        Some(found) => found.lost = found.lost.max(messages),
                        None => topics.push(TopicCompleteness { topic, lost: messages, ..TopicCompleteness::default() }),
                    }
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

/// What the index of a chunk promises of a channel.
#[derive(Default)]
struct Due {
    /// Log times of what is still to come.
    times: VecDeque<u64>,
    /// Entries that lie behind.
    passed: u64,
    /// Of these, those whose message was not there.
    lost: u64,
}

impl Due {
    /// Of the next message with this log time: how many are due before it, and its place in the index.
    fn find(&self, log_time: u64) -> Option<(usize, u64)> {
        let ahead = self.times.iter().position(|time| *time == log_time)?;
        Some((ahead, self.passed + ahead as u64))
    }

    /// That message is there; those that were due before it are not.
    fn take(&mut self, ahead: usize) {
        self.times.drain(..=ahead);
        self.passed += ahead as u64 + 1;
        self.lost += ahead as u64;
    }

    fn missing(&self) -> u64 {
        self.lost + self.times.len() as u64
    }
}

/// The indices that stand behind a chunk, and the record after them.
fn index_behind(from: &Path, frames: &mut Frames) -> Result<(Index, Option<Frame>), BagError> {
    let mut index = Index::new();
    while let Some(frame) = frames.next()? {
        if !matches!(frame.opcode, op::MESSAGE_INDEX | COMPACT_INDEX) || frame.cut {
            return Ok((index, Some(frame)));
        }
        let body = frames.body(&frame)?;
        if frame.opcode == COMPACT_INDEX {
            return Ok((decode_index(&body).unwrap_or_default(), None));
        }
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
            Begun::Not(file) => Begun::Yes(Box::new(options().profile(profile).library(library).create(BufWriter::new(file))?)),
            begun => begun,
        };
        match self {
            Begun::Yes(out) => Ok(out),
            Begun::Not(_) | Begun::Failed => Err(mcap::McapError::AttemptedWriteAfterFailure),
        }
    }

    fn end_chunk(&mut self) -> mcap::McapResult<()> {
        if let Begun::Yes(out) = self { out.flush() } else { Ok(()) }
    }
}

/// What a channel carries.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Carries {
    /// Messages of ours.
    Ours(Kind),
    /// Which step samples are of.
    Steps,
    /// Something else.
    Foreign,
}

/// A copy in the making.
struct Copy<'a> {
    from: &'a Path,
    begun: Begun,
    found: Channels,
    /// Channels in the copy.
    carried: HashMap<u16, Carries>,
    trackers: BTreeMap<u16, Tracker>,
    /// Which step samples are of, as far as the copy has come.
    said: Said,
    run: bool,
    report: RecoverReport,
}

impl Copy<'_> {
    /// Reads the channels of the summary, which outlive a damaged chunk that described them, and how many messages there were.
    fn look_ahead(&mut self, from: &Path) -> Result<Option<Statistics>, BagError> {
        let (mut frames, mut in_summary, mut statistics) = (Frames::open(from)?, false, None);
        while let Some(frame) = frames.next()? {
            in_summary |= frame.opcode == op::DATA_END;
            if !in_summary || frame.cut || !matches!(frame.opcode, op::SCHEMA | op::CHANNEL | op::STATISTICS) {
                continue;
            }
            let body = frames.body(&frame)?;
            match parse(from, &frame, &body) {
                Ok(Record::Statistics(found)) => statistics = Some(found),
                Ok(record) => self.found.see(record.into_owned()),
                Err(_) => {}
            }
        }
        Ok(statistics)
    }

    /// The content of a channel, from its description.
    fn carries(&self, id: u16) -> Carries {
        let Some(channel) = self.found.channels.get(&id) else { return Carries::Foreign };
        if self.found.says_steps(channel) {
            return Carries::Steps;
        }
        let schema = self.found.schemas.get(&channel.schema_id).filter(|_| channel.schema_id != 0); // 0 means none
        schema.and_then(|schema| ros::kind_of(&schema.0)).map_or(Carries::Foreign, Carries::Ours)
    }

    /// The message of a topic of ours, with its facts.
    fn decode(&self, said: &Said, kind: Kind, header: &MessageHeader, data: &[u8]) -> Result<Message, ros::RosError> {
        let topic = self.found.channels.get(&header.channel_id).map_or("", |channel| &channel.topic);
        decode(kind, said.of(topic, header.sequence).as_ref(), data)
    }

    /// Of what can be read in a damaged chunk: the messages in the chunk's index, in its order, that have the content of their type. A sample counts
    /// only if the chunk states which step it is of. The others are counted as missing.
    fn believable(&mut self, read: Vec<Record<'static>>, index: Index) -> Vec<Record<'static>> {
        let mut due: BTreeMap<u16, Due> =
            index.into_iter().map(|(channel, times)| (channel, Due { times: times.into(), ..Due::default() })).collect();
        let (mut kept, mut said) = (Vec::new(), Said::default());
        // Of a topic's channel: the place in the index of the last sample with facts, and its sequence number.
        let mut first: HashMap<u16, (u64, u64)> = HashMap::new();
        for record in read {
            let Record::Message { header, data } = &record else {
                self.found.see(record);
                continue;
            };
            let id = header.channel_id;
            let Some((ahead, place)) = due.get(&id).and_then(|due| due.find(header.log_time)) else { continue };
            let stamped = |stamp_ns: i64| u64::try_from(stamp_ns).unwrap_or(0) == header.publish_time;
            let fits = match self.carries(id) {
                // Without one of them the samples behind it are not what they seem.
                Carries::Steps if ahead > 0 => false,
                Carries::Steps => match ros::decode_steps(data) {
                    Ok((topic, facts)) if facts.stamp_ns.is_some_and(stamped) => {
                        for channel in self.found.channels.values().filter(|channel| channel.topic == topic) {
                            first.insert(channel.id, (due.get(&channel.id).map_or(0, |due| due.passed), facts.sequence));
                        }
                        said.hear(self.from, 0, data).is_ok()
                    }
                    _ => false,
                },
                Carries::Ours(kind) => match self.decode(&said, kind, header, data) {
                    Ok(message) => {
                        let counted = first
                            .get(&id)
                            .is_none_or(|(from, sequence)| sequence.checked_add(place.saturating_sub(*from)) == Some(message.sequence()));
                        counted && message.sequence() as u32 == header.sequence && stamped(message.stamp_ns())
                    }
                    Err(ros::RosError::Foreign { .. }) => self.found.steps().is_empty(),
                    Err(_) => false,
                },
                Carries::Foreign => true,
            };
            if fits {
                due.entry(id).and_modify(|due| due.take(ahead));
                self.report.unconfirmed += u64::from(self.carries(id) != Carries::Steps);
                kept.push(record);
            }
        }
        for (channel, due) in due.iter().filter(|(_, due)| due.missing() > 0) {
            if self.carries(*channel) == Carries::Steps {
                continue;
            }
            let name = self.found.channels.get(channel).map_or_else(|| format!("channel {channel}"), |channel| channel.topic.clone());
            *self.report.missing.entry(name).or_default() += due.missing();
        }
        kept
    }

    fn take(&mut self, record: Record, offset: u64) -> mcap::McapResult<()> {
        match record {
            Record::Header(header) => {
                self.begun.writer(&header.profile, &header.library)?;
            }
            Record::Message { header, data } => {
                let Some(carries) = self.channel(header.channel_id)? else {
                    let what = format!("byte {offset}: a message of channel {}, which was never described", header.channel_id);
                    self.report.damaged.push(what);
                    return Ok(());
                };
                if carries == Carries::Steps
                    && let Err(error) = self.said.hear(self.from, offset, &data)
                {
                    self.report.damaged.push(error.to_string());
                    return Ok(());
                }
                self.begun.writer("", "")?.write_to_known_channel(&header, &data)?;
                self.report.messages += u64::from(carries != Carries::Steps);
                if let Carries::Ours(kind) = carries
                    && let Ok(message) = self.decode(&self.said, kind, &header, &data)
                    && let Some(tracker) = self.trackers.get_mut(&header.channel_id)
                {
                    tracker.see(&message);
                }
            }
            Record::Attachment { header, data, .. } => {
                let (log_time, create_time, name, media_type) = (header.log_time, header.create_time, header.name, header.media_type);
                self.begun.writer("", "")?.attach(&mcap::Attachment { log_time, create_time, name, media_type, data })?;
                self.report.attachments += 1;
            }
            // The copy has indices, which contain the times.
            Record::Metadata(metadata) if metadata.name == COMPLETENESS || metadata.name == SPANS => {}
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
    fn channel(&mut self, id: u16) -> mcap::McapResult<Option<Carries>> {
        if let Some(carries) = self.carried.get(&id) {
            return Ok(Some(*carries));
        }
        let Some(channel) = self.found.channels.get(&id) else { return Ok(None) };
        let schema = self.found.schemas.get(&channel.schema_id).filter(|_| channel.schema_id != 0); // 0 means none
        let out = self.begun.writer("", "")?;
        let mut schema_id = 0;
        if let Some((name, encoding, text)) = schema {
            schema_id = out.add_schema_with_id(channel.schema_id, name, encoding, text)?;
        }
        out.add_channel_with_id(id, schema_id, &channel.topic, &channel.message_encoding, &channel.metadata)?;
        let carries = self.carries(id);
        self.carried.insert(id, carries);
        if let Carries::Ours(_) = carries {
            self.trackers.insert(id, Tracker::new(&channel.topic));
        }
        Ok(Some(carries))
    }
}
