//! Reads any MCAP file, whoever wrote it and however it ended.

mod attachments;
pub(crate) mod channels;
pub(crate) mod entry;
mod messages;
pub(crate) mod records;
mod summary;

pub use entry::{Entry, TopicRef};
pub use messages::Messages;

use crate::BagError;
use crate::completeness::{COMPLETENESS, Completeness};
use crate::framing::Frames;
use crate::header::{BagHeader, RUN};
use crate::offer::end_missing;
use crate::span::Spans;
use crate::steps::Said;
use attachments::Attachments;
use channels::Channels;
use mcap::records::{Metadata, Record, op};
use records::{parse, records};
use std::collections::{HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use summary::Summary;

/// A bag that is open for reading.
#[derive(Debug, Clone)]
pub struct Reader {
    path: PathBuf,
    profile: String,
    library: String,
    topics: Vec<Arc<TopicRef>>,
    /// Channels with the steps of samples.
    steps: Vec<u16>,
    counts: Vec<u64>,
    header: Option<BagHeader>,
    completeness: Option<Completeness>,
    damage: Vec<String>,
    contradictions: Vec<String>,
    closed: bool,
    bytes: u64,
}

impl Reader {
    /// Opens a bag: reads its own description. A bag that was cut off is walked through once.
    ///
    /// Damaged parts are left out and listed by [`Reader::damage`]: the messages can be read nevertheless. Errors: it cannot be read or is no MCAP
    /// file.
    pub fn open(path: &Path) -> Result<Reader, BagError> {
        let bytes = std::fs::metadata(path).map_err(BagError::io(path))?.len();
        let mut frames = Frames::open(path)?;
        let (mut profile, mut library) = (String::new(), String::new());
        let mut found = Channels::default();
        let (mut in_summary, mut summary_has_channels) = (false, false);
        let (mut metadata, mut attachments, mut statistics) = (Vec::new(), Attachments::default(), None);
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
                Record::Attachment { header, data, .. } => attachments.see(header.name, &data),
                record => {
                    summary_has_channels |= in_summary && matches!(record, Record::Channel(_));
                    found.see(record);
                }
            }
        }
        let closed = frames.closed;
        let Described { header, completeness, contradictions } = described(path, &metadata, attachments, &mut damage);
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
            contradictions,
            closed,
            bytes,
        })
    }

    /// Opens a bag by its end, and returns the first and last time of each topic: in the same time whatever its size. `None` where the end is not
    /// complete: it was not closed, or others wrote it without statistics or indices.
    pub(crate) fn of_summary(path: &Path) -> Result<Option<(Reader, Spans)>, BagError> {
        let (Some(summary), bytes) = summary::of_file(path).map_err(BagError::io(path))? else { return Ok(None) };
        let Summary { profile, library, found, metadata, attachments, statistics: Some(statistics), spans: Some(spans) } = summary else {
            return Ok(None);
        };
        let mut damage = Vec::new();
        let Described { header, completeness, contradictions } = described(path, &metadata, attachments, &mut damage);
        let steps = found.steps();
        let topics = found.topics(header.as_ref());
        let counts = topics.iter().map(|topic| statistics.channel_message_counts.get(&topic.channel).copied().unwrap_or(0)).collect();
        let path = path.to_owned();
        let closed = true;
        let reader = Reader { path, profile, library, topics, steps, counts, header, completeness, damage, contradictions, closed, bytes };
        Ok(Some((reader, spans)))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Every topic, in the order of the run's header if there is one, then by channel. The channel on which a bag of ours records the steps of
    /// samples is left out; see [`Entry::facts`].
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

    /// Where the bag's description of itself excludes itself: files that it names and does not hold, two records of one kind that differ.
    pub fn contradictions(&self) -> &[String] {
        &self.contradictions
    }

    /// Whether the writer closed the file.
    pub fn ended_cleanly(&self) -> bool {
        self.closed
    }

    /// Opens a bag whose messages are needed.
    ///
    /// # Errors
    /// Those of [`Reader::open`], or the file is cut off before its first message.
    pub fn open_begun(path: &Path) -> Result<Reader, BagError> {
        let reader = Reader::open(path)?;
        match reader.without_messages() {
            Some(what) => Err(BagError::File { path: path.to_owned(), what }),
            None => Ok(reader),
        }
    }

    /// A sentence for a file that breaks off before its first message, so that nothing of it can be saved; `None` for any other.
    pub fn without_messages(&self) -> Option<String> {
        let is_empty = || self.messages().is_ok_and(|mut all| all.next().is_none());
        (!self.closed && is_empty()).then(|| "the file was not closed and is cut off before its first message; record it again".to_owned())
    }

    /// A sentence for a file that was not closed, with the command that saves what there is; `None` for one that was.
    pub(crate) fn end_missing(&self) -> Option<String> {
        self.without_messages().or_else(|| end_missing(&self.path, self.closed))
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
    /// A bag that was cut off ends with its last whole message, without an error: [`Reader::ended_cleanly`] shows this. Damage before the end is an
    /// error with its place, and the iteration ends there.
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

/// What backdrive wrote of a run.
struct Described {
    header: Option<BagHeader>,
    completeness: Option<Completeness>,
    contradictions: Vec<String>,
}

/// What backdrive wrote of the run; what of it cannot be read goes to `damage`.
fn described(path: &Path, metadata: &[Metadata], attachments: Attachments, damage: &mut Vec<String>) -> Described {
    let Attachments { texts, doubled } = attachments;
    let mut contradictions: Vec<String> =
        doubled.into_iter().map(|name| format!("two different files in it are called \"{name}\"; the first counts")).collect();
    for name in [RUN, COMPLETENESS] {
        let mut all = metadata.iter().filter(|record| record.name == name);
        if let Some(first) = all.next().filter(|first| all.any(|other| other.metadata != first.metadata)) {
            contradictions.push(format!("it holds two records {} that differ; the last counts", first.name));
        }
    }
    let missing = std::cell::RefCell::new(Vec::new());
    let text = |name: &str| {
        let found = texts.get(name).cloned();
        if found.is_none() {
            missing.borrow_mut().push(format!("it lists the file \"{name}\" but does not contain it"));
        }
        found
    };
    let header = last(metadata, RUN)
        .map(|record| BagHeader::from_metadata(path, &record.metadata, text))
        .and_then(|header| header.map_err(|error| damage.push(error.to_string())).ok());
    let completeness = last(metadata, COMPLETENESS)
        .map(|record| verdict(path, record))
        .and_then(|verdict| verdict.map_err(|error| damage.push(error.to_string())).ok());
    contradictions.append(&mut missing.into_inner());
    Described { header, completeness, contradictions }
}

fn last<'a>(metadata: &'a [Metadata], name: &str) -> Option<&'a Metadata> {
    metadata.iter().rev().find(|record| record.name == name)
}

fn verdict(path: &Path, record: &Metadata) -> Result<Completeness, BagError> {
    let wrong = |what: String| BagError::Metadata { path: path.to_owned(), record: COMPLETENESS, key: "verdict", what };
    let text = record.metadata.get("verdict").ok_or_else(|| wrong("is missing".to_owned()))?;
    serde_json::from_str(text).map_err(|error| wrong(error.to_string()))
}
