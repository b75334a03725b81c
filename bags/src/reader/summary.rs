//! A bag's own summary at its end, read without its messages: a bag of any size takes the same time.

use super::attachments::Attachments;
use super::channels::Channels;
use super::records::parse;
use crate::framing::Frame;
use crate::span::{SPANS, Spans};
use mcap::records::{ChunkIndex, Metadata, Record, Statistics, op};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Op code and length.
const PREFIX: u64 = 9;
/// Footer record and the magic behind it.
const END: u64 = PREFIX + 20 + mcap::MAGIC.len() as u64;
/// Above this a summary is not believed, bytes.
const LARGEST: u64 = 1 << 28;

/// What stands at the end of a bag that was closed, and what the indices there point to.
#[derive(Default)]
pub(crate) struct Summary {
    pub(crate) profile: String,
    pub(crate) library: String,
    pub(crate) found: Channels,
    pub(crate) metadata: Vec<Metadata>,
    pub(crate) attachments: Attachments,
    pub(crate) statistics: Option<Statistics>,
    /// `None` where neither the recorder nor MCAP's indices have them.
    pub(crate) spans: Option<Spans>,
}

/// Reads it; `None` where there is none, or it is incomplete or damaged: then only a walk over the whole file gives the answer.
pub(crate) fn summary<R: Read + Seek>(path: &Path, source: &mut R, size: u64) -> Option<Summary> {
    let mut source = Source { path, source, size };
    if source.bytes(0, mcap::MAGIC.len() as u64)? != mcap::MAGIC {
        return None;
    }
    let footer_at = size.checked_sub(END)?;
    let end = source.bytes(footer_at, END)?;
    let Record::Footer(footer) = source.parse(footer_at, end.get(..end.len() - mcap::MAGIC.len())?)? else { return None };
    if !end.ends_with(mcap::MAGIC) || footer.summary_start == 0 {
        return None;
    }
    let all = source.bytes(footer.summary_start, footer_at.checked_sub(footer.summary_start)?)?;
    // The checksum is of the summary and of the footer up to the checksum itself.
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&all);
    hasher.update(&end[..(PREFIX + 16) as usize]);
    if footer.summary_crc != 0 && footer.summary_crc != hasher.finalize() {
        return None;
    }
    let mut summary = Summary::default();
    let Record::Header(header) = source.record(mcap::MAGIC.len() as u64)? else { return None };
    (summary.profile, summary.library) = (header.profile, header.library);
    let (mut chunks, mut rest, mut at, mut spans_at) = (Vec::new(), all.as_slice(), footer.summary_start, 0);
    while !rest.is_empty() {
        let len = PREFIX.checked_add(u64::from_le_bytes(rest.get(1..PREFIX as usize)?.try_into().ok()?))?;
        let (record, behind) = rest.split_at_checked(usize::try_from(len).ok()?)?;
        match source.parse(at, record)? {
            Record::Statistics(statistics) => summary.statistics = Some(statistics),
            Record::ChunkIndex(chunk) => chunks.push(chunk),
            Record::MetadataIndex(index) => {
                let Record::Metadata(metadata) = source.record(index.offset)? else { return None };
                spans_at = if metadata.name == SPANS { index.offset } else { spans_at };
                summary.metadata.push(metadata);
            }
            Record::AttachmentIndex(index) => {
                let Record::Attachment { header, data, .. } = source.record(index.offset)? else { return None };
                summary.attachments.see(header.name, &data);
            }
            record @ (Record::Schema { .. } | Record::Channel(_)) => summary.found.see(record.into_owned()),
            _ => {}
        }
        (rest, at) = (behind, at + len);
    }
    let statistics = summary.statistics.as_ref()?;
    let told = |all: u32, found: usize| all as usize == found;
    let counted = statistics.channel_message_counts.values().try_fold(0_u64, |sum, count| sum.checked_add(*count));
    if !told(statistics.channel_count, summary.found.channels.len())
        || !told(statistics.metadata_count, summary.metadata.len())
        || counted != Some(statistics.message_count)
    {
        return None;
    }
    summary.spans = match summary.metadata.iter().rev().find(|record| record.name == SPANS) {
        // Where it does not stand where its writer put it, another program wrote the bag again, and may have left messages out.
        Some(record) if !Spans::are_in_place(record, spans_at) => return None,
        Some(record) => Some(Spans::from_metadata(record)?),
        None => source.spans(&chunks, statistics),
    };
    Some(summary)
}

struct Source<'a, R> {
    path: &'a Path,
    source: &'a mut R,
    size: u64,
}

impl<R: Read + Seek> Source<'_, R> {
    fn bytes(&mut self, at: u64, len: u64) -> Option<Vec<u8>> {
        if at.checked_add(len)? > self.size || len > LARGEST {
            return None;
        }
        let mut bytes = vec![0; len as usize];
        let read = self.source.seek(SeekFrom::Start(at)).and_then(|_| self.source.read_exact(&mut bytes));
        read.ok().map(|()| bytes)
    }

    /// Of a record with its op code and length.
    fn parse(&self, offset: u64, record: &[u8]) -> Option<Record<'static>> {
        let (prefix, body) = record.split_at_checked(PREFIX as usize)?;
        let frame = Frame { offset, opcode: prefix[0], len: body.len() as u64, cut: false };
        let len = u64::from_le_bytes(prefix[1..].try_into().ok()?);
        if len != frame.len {
            return None;
        }
        parse(self.path, &frame, body).ok().map(Record::into_owned)
    }

    fn record(&mut self, at: u64) -> Option<Record<'static>> {
        let prefix = self.bytes(at, PREFIX)?;
        let len = u64::from_le_bytes(prefix[1..].try_into().ok()?);
        // A chunk is never asked for.
        if prefix[0] == op::CHUNK {
            return None;
        }
        let record = self.bytes(at, PREFIX.checked_add(len)?)?;
        self.parse(at, &record)
    }

    /// From the message indices of the first and the last chunk in which a channel speaks.
    fn spans(&mut self, chunks: &[ChunkIndex], statistics: &Statistics) -> Option<Spans> {
        let mut spans = Spans::default();
        for channel in statistics.channel_message_counts.iter().filter(|(_, count)| **count > 0).map(|(channel, _)| *channel) {
            let within = || chunks.iter().filter(|chunk| chunk.message_index_offsets.contains_key(&channel));
            let first = within().min_by_key(|chunk| chunk.message_start_time)?;
            let last = within().max_by_key(|chunk| chunk.message_end_time)?;
            for chunk in [first, last] {
                let Record::MessageIndex(index) = self.record(*chunk.message_index_offsets.get(&channel)?)? else { return None };
                if index.channel_id != channel {
                    return None;
                }
                index.records.iter().for_each(|entry| spans.see(channel, entry.log_time));
            }
        }
        Some(spans)
    }
}

/// Opens a file only to look at its end.
pub(crate) fn of_file(path: &Path) -> io::Result<(Option<Summary>, u64)> {
    let mut file = backdrive_plant::input_file::open(path)?;
    let size = file.metadata()?.len();
    Ok((summary(path, &mut file, size), size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// Counts what is read of it.
    struct Counting {
        bytes: Cursor<Vec<u8>>,
        read: u64,
    }

    impl Read for Counting {
        fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
            let read = self.bytes.read(room)?;
            self.read += read as u64;
            Ok(read)
        }
    }

    impl Seek for Counting {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.bytes.seek(to)
        }
    }

    /// A bag of ours, or one with MCAP's indices, with this number of steps.
    fn bag(steps: u64, indexed: bool) -> Vec<u8> {
        use crate::{BagHeader, Recorder, RecorderOptions, TopicInfo};
        use backdrive_msgs::topic::{Kind, Topic};
        let dir = tempfile::tempdir().unwrap();
        let (path, copy) = (dir.path().join("run.mcap"), dir.path().join("copy.mcap"));
        let topic = Topic { name: "/t".to_owned(), kind: Kind::Sample };
        let info = TopicInfo { topic, axes: vec!["x".to_owned()], publisher: "p".to_owned() };
        let header = BagHeader { rate_hz: 1000.0, topics: vec![info], ..BagHeader::default() };
        let mut recorder = Recorder::create(&path, &header, &RecorderOptions::lockstep()).unwrap();
        for step in 0..steps {
            let mut sample = backdrive_msgs::Sample::new(1);
            (sample.step, sample.sequence, sample.stamp_ns) = (step, step, step as i64 * 1_000_000);
            sample.position[0] = (step as f64 * 0.37).sin();
            recorder.push(0, backdrive_msgs::Message::Sample(sample), 0).unwrap();
        }
        recorder.finish().unwrap();
        if indexed {
            crate::recover(&path, &copy, false).unwrap();
        }
        std::fs::read(if indexed { copy } else { path }).unwrap()
    }

    #[test]
    fn it_costs_the_same_however_long_the_bag_is() {
        for indexed in [false, true] {
            let read = [20_000, 200_000].map(|steps| {
                let bytes = bag(steps, indexed);
                let (size, mut source) = (bytes.len() as u64, Counting { bytes: Cursor::new(bytes), read: 0 });
                let found = summary(Path::new("x.mcap"), &mut source, size).expect("it has a summary");
                assert_eq!(found.statistics.map(|statistics| statistics.message_count > steps), Some(true), "samples, and what they are");
                let spans = found.spans.expect("it is known from when to when");
                let whole = (0, (steps - 1) * 1_000_000);
                assert!(spans.0.values().any(|span| *span == whole), "{spans:?}");
                (source.read, size)
            });
            let [(few, _), (many, size)] = read;
            // With MCAP's indices the summary grows by a record a chunk; what is read of the messages does not.
            let most = if indexed { few + 200_000 } else { few + 100 };
            assert!(many <= most && many < size / 10, "indexed {indexed}: {few} bytes, then {many} of {size}");
        }
    }

    #[test]
    fn what_is_cut_off_or_wrong_has_none() {
        let bytes = bag(2_000, true);
        let look = |bytes: &[u8]| summary(Path::new("x.mcap"), &mut Cursor::new(bytes), bytes.len() as u64).is_some();
        assert!(look(&bytes));
        for cut in [0, 3, 8, 40, bytes.len() / 2, bytes.len() - 1] {
            assert!(!look(&bytes[..cut]), "cut at {cut}");
        }
        for back in 9..600 {
            let mut wrong = bytes.clone();
            let at = bytes.len() - back;
            wrong[at] ^= 0x10;
            assert!(!look(&wrong), "a wrong byte {back} before the end");
        }
    }
}
