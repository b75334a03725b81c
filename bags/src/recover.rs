//! Saves what a killed recorder, a full disk or a broken copy left behind.

use crate::completeness::{COMPLETENESS, Completeness, Tracker};
use crate::framing::Frames;
use crate::header::{BagHeader, RUN};
use crate::reader::{Channels, records};
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
    /// Records or chunks that are damaged, with their place; nothing of them is in the copy.
    pub damaged: Vec<String>,
    /// The verdict in the copy, for bags of ours.
    pub completeness: Option<Completeness>,
}

/// Copies everything that is whole into a clean bag.
///
/// Only the chunk that was open when the recorder died is lost, and of it the messages that had not reached the
/// file. Errors: `from` cannot be read or is no MCAP file, `to` exists or cannot be written.
pub fn recover(from: &Path, to: &Path) -> Result<RecoverReport, BagError> {
    let mut frames = Frames::open(from)?;
    let file = File::create_new(to).map_err(BagError::io(to))?;
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
    let mut last = None::<u64>;
    while let Some(frame) = frames.next()? {
        if frame.opcode == op::DATA_END {
            break; // what follows is the summary, which the copy makes anew
        }
        let wanted =
            matches!(frame.opcode, op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::ATTACHMENT | op::METADATA);
        if !wanted || frame.cut && frame.opcode != op::CHUNK {
            continue;
        }
        let body = frames.body(&frame)?;
        let (whole, error) = records(from, &frame, &body);
        copy.report.damaged.extend(error.map(|error| error.to_string()));
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
    let out = begun.writer("", "").map_err(failed)?;
    if run {
        // A verdict of the recorder knows more than the sequence numbers tell, if the bag got as far.
        let told = Reader::open(from).ok().and_then(|reader| reader.completeness().cloned()).filter(|_| report.damaged.is_empty());
        let counted = || Completeness { topics: trackers.into_values().map(|tracker| tracker.found).collect(), late: 0, recovered: true };
        let verdict = told.unwrap_or_else(counted);
        let record =
            completeness_record(&verdict).map_err(|error| BagError::Write { name: to.display().to_string(), what: error.to_string() })?;
        out.write_metadata(&record).map_err(failed)?;
        report.completeness = Some(verdict);
    }
    out.finish().map_err(failed)?;
    Ok(report)
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
