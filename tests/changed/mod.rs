//! Bags as another program writes them again: read, changed in one way, written.

#![allow(dead_code)] // each test program uses its own part

pub mod kinds;

use mcap::records::{Metadata, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader};
use std::collections::BTreeMap;
use std::io::{BufWriter, Read};
use std::path::Path;

/// A message as it stands in a file.
#[derive(Clone)]
pub struct Entry {
    pub topic: String,
    pub header: mcap::records::MessageHeader,
    pub data: Vec<u8>,
}

/// All of a bag.
#[derive(Clone, Default)]
pub struct Bag {
    pub messages: Vec<Entry>,
    pub attachments: Vec<(String, Vec<u8>)>,
    pub metadata: Vec<Metadata>,
    channels: BTreeMap<u16, (String, String, u16)>,
    schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
}

/// Which numbers of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Numbers {
    Position,
    Effort,
}

impl Bag {
    pub fn load(path: &Path) -> Bag {
        let bytes = std::fs::read(path).unwrap();
        let (mut reader, mut source, mut bag) = (LinearReader::new(), bytes.as_slice(), Bag::default());
        while let Some(event) = reader.next_event() {
            match event.unwrap() {
                LinearReadEvent::ReadRequest(wanted) => {
                    let read = source.read(reader.insert(wanted)).unwrap();
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { opcode, data } => bag.see(mcap::read::parse_record(opcode, data).unwrap()),
            }
        }
        bag
    }

    fn see(&mut self, record: Record) {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) => {
                self.channels.insert(channel.id, (channel.topic, channel.message_encoding, channel.schema_id));
            }
            Record::Message { header, data } => {
                let topic = self.channels[&header.channel_id].0.clone();
                self.messages.push(Entry { topic, header, data: data.into_owned() });
            }
            Record::Attachment { header, data, .. } => self.attachments.push((header.name, data.into_owned())),
            Record::Metadata(metadata) => self.metadata.push(metadata),
            _ => {}
        }
    }

    /// Writes it with statistics and indices of its own.
    pub fn save(&self, path: &Path) {
        let options = mcap::WriteOptions::new().profile("ros2").library("another program").chunk_size(None);
        let mut out = options.create(BufWriter::new(std::fs::File::create(path).unwrap())).unwrap();
        let at_end = |metadata: &&Metadata| metadata.name != "backdrive.run";
        for metadata in self.metadata.iter().filter(|m| !at_end(m)) {
            out.write_metadata(metadata).unwrap();
        }
        for (name, data) in &self.attachments {
            let (log_time, create_time, media_type) = (0, 0, "text/plain".to_owned());
            out.attach(&mcap::Attachment { log_time, create_time, name: name.clone(), media_type, data: data.as_slice().into() }).unwrap();
        }
        let mut ids = BTreeMap::new();
        for (id, (topic, encoding, schema)) in &self.channels {
            let (name, form, text) = &self.schemas[schema];
            let schema = out.add_schema(name, form, text).unwrap();
            ids.insert(*id, out.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap());
        }
        for Entry { header, data, .. } in &self.messages {
            let header = mcap::records::MessageHeader { channel_id: ids[&header.channel_id], ..*header };
            out.write_to_known_channel(&header, data).unwrap();
        }
        for metadata in self.metadata.iter().filter(at_end) {
            out.write_metadata(metadata).unwrap();
        }
        out.finish().unwrap();
    }

    /// A metadata record.
    pub fn record(&mut self, name: &str) -> &mut BTreeMap<String, String> {
        &mut self.metadata.iter_mut().find(|m| m.name == name).unwrap().metadata
    }

    /// Removes the record of its recorder.
    pub fn forget_completeness(&mut self) {
        self.metadata.retain(|m| m.name != "backdrive.completeness");
    }

    /// Changes the text of its graph.
    pub fn graph(&mut self, change: impl Fn(&str) -> String) {
        let graph = self.record("backdrive.run").get_mut("graph").unwrap();
        *graph = change(graph);
    }

    /// Changes the numbers of a topic's samples; `change` is given the sample's place among them and its number.
    pub fn numbers(&mut self, topic: &str, which: Numbers, change: impl Fn(usize, f64) -> f64) {
        for (index, entry) in self.messages.iter_mut().filter(|m| m.topic == topic).enumerate() {
            for at in places(&entry.data, which) {
                let number = f64::from_le_bytes(entry.data[at..at + 8].try_into().unwrap());
                entry.data[at..at + 8].copy_from_slice(&change(index, number).to_le_bytes());
            }
        }
    }

    /// The numbers of a topic's samples, the first of each.
    pub fn values(&self, topic: &str, which: Numbers) -> Vec<f64> {
        let of_topic = self.messages.iter().filter(|m| m.topic == topic);
        of_topic
            .filter_map(|m| {
                let at = *places(&m.data, which).first()?;
                Some(f64::from_le_bytes(m.data[at..at + 8].try_into().unwrap()))
            })
            .collect()
    }

    /// How many messages a topic has.
    pub fn count(&self, topic: &str) -> usize {
        self.messages.iter().filter(|m| m.topic == topic).count()
    }

    /// Keeps the messages that `keep` accepts: topic, place on its topic, of how many.
    pub fn keep(&mut self, keep: impl Fn(&str, usize, usize) -> bool) {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        self.messages.iter().for_each(|m| *counts.entry(m.topic.clone()).or_default() += 1);
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        self.messages.retain(|m| {
            let place = places.entry(m.topic.clone()).or_default();
            *place += 1;
            m.topic == "/backdrive/steps" || keep(&m.topic, *place - 1, counts[&m.topic])
        });
    }

    /// Topics of samples with messages.
    pub fn samples(&self) -> Vec<String> {
        let mut topics: Vec<String> = Vec::new();
        for message in self.messages.iter().filter(|m| m.topic.ends_with("_js") || m.topic.ends_with("_jp") || m.topic.ends_with("_jf")) {
            if !topics.contains(&message.topic) {
                topics.push(message.topic.clone());
            }
        }
        topics
    }
}

/// Where in a CDR JointState the numbers of one array stand.
fn places(data: &[u8], which: Numbers) -> Vec<usize> {
    // Behind the four bytes of the encapsulation, from which alignment counts.
    let body = &data[4..];
    let number = |at: usize| u32::from_le_bytes(body[at..at + 4].try_into().unwrap()) as usize;
    let aligned = |at: usize, to: usize| at.div_ceil(to) * to;
    let mut at = 8;
    at += 4 + number(at); // frame_id
    at = aligned(at, 4);
    let names = number(at);
    at += 4;
    for _ in 0..names {
        at = aligned(at, 4);
        at += 4 + number(at);
    }
    for of in [Some(Numbers::Position), None, Some(Numbers::Effort)] {
        at = aligned(at, 4);
        let count = number(at);
        at += 4;
        if count > 0 {
            at = aligned(at, 8);
        }
        if of == Some(which) {
            return (0..count).map(|k| 4 + at + 8 * k).collect();
        }
        at += 8 * count;
    }
    Vec::new()
}
