//! Records of a file, out of chunks too, whole or as far as they go.

use crate::BagError;
use crate::framing::Frame;
use crate::lengths::within;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::io::Read;
use std::path::Path;

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
    // The size that a chunk states is allocated before anything is unpacked.
    let most = body.len().saturating_mul(256).clamp(LIKELY_CHUNK, LARGEST_CHUNK);
    let unpacked = body.get(16..24).and_then(|bytes| bytes.first_chunk()).map_or(0, |bytes| u64::from_le_bytes(*bytes));
    if unpacked > most as u64 {
        let error = damaged(format!("a chunk of {} bytes claims to unpack to {unpacked}", body.len()));
        return (Vec::new(), (!frame.cut).then_some(error));
    }
    // Of a whole chunk the checksum is verified before anything in it is believed: lengths in a damaged one ask for any amount of memory.
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(strict && !frame.cut)
        .with_prevalidate_chunk_crcs(strict && !frame.cut)
        .with_record_length_limit(most);
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

/// A chunk may be as large as this whatever it was packed to, bytes.
const LIKELY_CHUNK: usize = 1 << 26;

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

/// Parses the body of a record that is whole.
pub(crate) fn parse<'a>(path: &Path, frame: &Frame, body: &'a [u8]) -> Result<Record<'a>, BagError> {
    let damaged = |what: String| BagError::Damaged { path: path.to_owned(), offset: frame.offset, what };
    if !within(frame.opcode, body) {
        let len = body.len();
        return Err(damaged(format!("record of type 0x{:02x}, {len} bytes: a length in it goes beyond its end", frame.opcode)));
    }
    // mcap 0.26 slices an attachment without looking at its length first.
    if frame.opcode == op::ATTACHMENT && attachment_header_len(body).is_none_or(|len| len + 4 > body.len()) {
        return Err(damaged(format!("an attachment record of {} bytes is too short for its own header", body.len())));
    }
    if frame.opcode == op::ATTACHMENT
        && let Some((fields, sum)) = body.split_last_chunk::<4>()
        && !matches!(u32::from_le_bytes(*sum), 0)
        && crc32fast::hash(fields) != u32::from_le_bytes(*sum)
    {
        return Err(damaged("an attachment does not have its checksum: it was changed".to_owned()));
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
