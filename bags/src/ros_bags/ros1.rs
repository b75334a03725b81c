//! A bag of ROS 1.

use super::ros1_message::Converter;
use super::target::{Form, Target};
use crate::BagError;
use crate::memory::Memory;
use rosbag::{ChunkRecord, MessageRecord, RosBag};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Where the messages of a connection go.
struct Topic {
    name: String,
    place: usize,
    /// How they become messages of ROS 2; `None` where they are kept as they are.
    converter: Option<Converter>,
}

/// Copies the messages of a bag, chunk by chunk.
pub(crate) fn copy(file: &Path, target: &mut Target, most_bytes: u64) -> Result<(), BagError> {
    let wrong = |what: String| BagError::File { path: file.to_owned(), what };
    check_extent(file)?;
    check_chunks(file, most_bytes).map_err(wrong)?;
    let failed =
        |error: rosbag::Error| wrong(format!("cannot be read as a ROS 1 bag: {error}; `rosbag reindex` may save one that was cut off"));
    let bag = RosBag::new(file).map_err(|error| wrong(format!("cannot be read as a ROS 1 bag: {error}")))?;
    let mut topics: HashMap<u32, Topic> = HashMap::new();
    let mut payload = Vec::new();
    for record in bag.chunk_records() {
        let ChunkRecord::Chunk(chunk) = record.map_err(failed)? else { continue };
        for message in chunk.messages() {
            match message.map_err(failed)? {
                MessageRecord::Connection(connection) => {
                    if let Entry::Vacant(vacant) = topics.entry(connection.id) {
                        vacant.insert(announce(target, connection.topic, connection.tp, connection.message_definition)?);
                    }
                }
                MessageRecord::MessageData(message) => {
                    let topic = topics.get(&message.conn_id).ok_or_else(|| {
                        wrong(format!(
                            "a message at {} ns is of connection {}, which is not described before it",
                            message.time, message.conn_id
                        ))
                    })?;
                    let time = i64::try_from(message.time).unwrap_or(i64::MAX);
                    match &topic.converter {
                        Some(converter) => {
                            let converted = converter.convert(message.data, &mut payload);
                            converted.map_err(|what| wrong(format!("{}, message at {time} ns: {what}; it is damaged", topic.name)))?;
                            target.push(topic.place, time, &payload)?;
                        }
                        None => target.push(topic.place, time, message.data)?,
                    }
                }
            }
        }
    }
    Ok(())
}

/// The reader takes on trust the stated end of the chunks; in a bag that was not closed, or cut off, it is wrong.
fn check_extent(file: &Path) -> Result<(), BagError> {
    let wrong = |what: &str| Err(BagError::File { path: file.to_owned(), what: what.to_owned() });
    let mut start = Vec::new();
    let (mut open, size) = backdrive_plant::input_file::open(file)
        .and_then(|open| open.metadata().map(|about| (open, about.len())))
        .map_err(BagError::io(file))?;
    open.by_ref().take(4096).read_to_end(&mut start).map_err(BagError::io(file))?;
    let number = |at: usize, bytes: usize| {
        let bytes = start.get(at..at.checked_add(bytes)?)?;
        Some(bytes.iter().rev().fold(0_u64, |number, byte| number << 8 | u64::from(*byte)))
    };
    // Magic, length and fields of the first record, length and filling behind them.
    let header = number(MAGIC, 4).and_then(|length| usize::try_from(length).ok()).unwrap_or(usize::MAX);
    let fields = start.get(MAGIC + 4..(MAGIC + 4).saturating_add(header)).unwrap_or_default();
    let place = fields.windows(INDEX.len()).position(|found| found == INDEX).map(|place| MAGIC + 4 + place + INDEX.len());
    let index = place.and_then(|place| number(place, 8));
    let begin = number((MAGIC + 4).saturating_add(header), 4).map(|filling| (MAGIC + 8 + header) as u64 + filling);
    match (begin, index) {
        (Some(_), Some(0)) => wrong("has no index: it was not closed; `rosbag reindex` makes one"),
        (Some(begin), Some(index)) if index < begin => wrong("byte 13: its header is damaged: the index would precede the messages"),
        (Some(_), Some(index)) if index > size => wrong("was cut off: its index is missing; `rosbag reindex` rebuilds it"),
        (Some(_), Some(_)) => Ok(()),
        _ => wrong("byte 13: its header cannot be read; it was cut off or is damaged"),
    }
}

/// The reader unpacks a chunk whole, and allocates the size that the chunk states. Only the heads of records are read here.
fn check_chunks(file: &Path, most_bytes: u64) -> Result<(), String> {
    let Ok(open) = backdrive_plant::input_file::open(file) else { return Ok(()) };
    let mut bytes = BufReader::new(open);
    let mut at = MAGIC as u64;
    // What is cut off or damaged is the reader's to report.
    while bytes.seek(SeekFrom::Start(at)).is_ok() {
        let mut word = [0; 4];
        let mut header = Vec::new();
        if bytes.read_exact(&mut word).is_err() {
            break;
        }
        let head = u32::from_le_bytes(word);
        if bytes.by_ref().take(head.into()).read_to_end(&mut header).is_err() || bytes.read_exact(&mut word).is_err() {
            break;
        }
        let field = |name: &[u8]| {
            let place = header.windows(name.len()).position(|found| found == name)?;
            header.get(place + name.len()..)
        };
        let is_chunk = field(b"op=").and_then(|value| value.first()) == Some(&CHUNK);
        let size = field(b"size=").and_then(|value| value.first_chunk()).map_or(0, |size| u32::from_le_bytes(*size).into());
        if is_chunk {
            Memory::new(most_bytes).take(size).map_err(|what| format!("byte {at}: a chunk {what}"))?;
        }
        at += 8 + u64::from(head) + u64::from(u32::from_le_bytes(word));
    }
    Ok(())
}

/// Kind of a record that holds messages.
const CHUNK: u8 = 5;

/// Bytes of `#ROSBAG V2.0` and a line feed.
const MAGIC: usize = 13;

/// The field with the position at which the index begins.
const INDEX: &[u8] = b"index_pos=";

fn announce(target: &mut Target, name: &str, type_name: &str, definition: &str) -> Result<Topic, BagError> {
    match Converter::new(type_name, definition) {
        Ok(converter) => {
            let form = Form {
                type_name: &converter.type_name,
                schema_encoding: "ros2msg",
                definition: &converter.definition,
                encoding: "cdr",
                qos: "",
            };
            let place = target.topic(name, &form, None)?;
            Ok(Topic { name: name.to_owned(), place, converter: Some(converter) })
        }
        Err(what) => {
            let note = format!("its messages are kept in the form of ROS 1, which is not decoded: {what}");
            let form = Form { type_name, schema_encoding: "ros1msg", definition, encoding: "ros1", qos: "" };
            let place = target.topic(name, &form, Some(note))?;
            Ok(Topic { name: name.to_owned(), place, converter: None })
        }
    }
}
