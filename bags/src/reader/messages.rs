//! Every message in the order of the file.

use super::entry::{Entry, TopicRef};
use super::records::records;
use crate::BagError;
use crate::framing::Frames;
use crate::steps::Said;
use backdrive_msgs::topic::Kind;
use mcap::records::{MessageHeader, Record, op};
use std::collections::{HashMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

/// See [`crate::Reader::messages`].
pub struct Messages {
    pub(super) path: PathBuf,
    pub(super) frames: Frames,
    pub(super) topics: HashMap<u16, Arc<TopicRef>>,
    pub(super) steps: Vec<u16>,
    pub(super) said: Said,
    pub(super) pending: VecDeque<(MessageHeader, Vec<u8>)>,
    pub(super) offset: u64,
    pub(super) done: bool,
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
