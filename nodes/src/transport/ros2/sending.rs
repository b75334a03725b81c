//! A publisher over ROS 2.

use super::participant::Writer;
use super::shared::{FLUSH, Shared};
use crate::clock::now_ns;
use crate::transport::{Publisher, TransportError, wrong_kind};
use backdrive_msgs::Message;
use backdrive_msgs::ros::live;
use backdrive_msgs::topic::{Kind, Topic};
use rustdds::bytes::Bytes;
use rustdds::{DataWriterStatus, StatusEvented, Timestamp};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

pub(super) struct Sending {
    shared: Rc<Shared>,
    topic: Topic,
    /// Who reports an event: the first part of its topic's name.
    speaker: String,
    names: Vec<String>,
    writer: RefCell<Writer>,
    participants: Cell<u32>,
    matched: Cell<usize>,
    /// When it began to count from 0: CLOCK_MONOTONIC, ns. A publisher that is started again counts in a later life.
    life: u64,
    newest: Option<u64>,
    cdr: Vec<u8>,
}

impl Sending {
    pub fn new(shared: &Rc<Shared>, topic: &Topic) -> Result<Sending, TransportError> {
        let names = match topic.kind {
            Kind::Sample => shared.axes.get(&topic.name).cloned().unwrap_or_default(),
            kind => live::fields(kind).iter().map(|name| (*name).to_string()).collect(),
        };
        Ok(Sending {
            writer: RefCell::new(shared.participant().writer(topic, shared.delivery)?),
            participants: Cell::new(shared.life.get()),
            shared: Rc::clone(shared),
            topic: topic.clone(),
            speaker: topic.name.split('/').nth(1).unwrap_or_default().to_string(),
            names,
            matched: Cell::new(0),
            life: now_ns().unsigned_abs(),
            newest: None,
            cdr: Vec::with_capacity(512),
        })
    }

    /// Has a writer of the participant that the node has now.
    fn revive(&self) -> Result<(), TransportError> {
        if self.participants.replace(self.shared.life.get()) != self.shared.life.get() {
            self.matched.set(0);
            self.writer.replace(self.shared.participant().writer(&self.topic, self.shared.delivery)?);
        }
        Ok(())
    }
}

impl Publisher for Sending {
    fn send(&mut self, message: &Message) -> Result<(), TransportError> {
        if message.kind() != self.topic.kind {
            return Err(wrong_kind(&self.topic, message));
        }
        self.revive()?;
        let broken = |reason: String| TransportError::Broken { topic: self.topic.name.clone(), reason };
        // A bridge passes on what a node sends that was started again.
        if self.newest.is_some_and(|newest| message.sequence() <= newest) {
            self.life = now_ns().unsigned_abs().max(self.life + 1);
        }
        self.newest = Some(message.sequence());
        let encoded = match &self.shared.identity {
            Some(identity) => identity.encode(&self.topic, message, &self.speaker, &self.names, self.life, &mut self.cdr),
            None => live::encode(message, &self.speaker, &self.names, None, &mut self.cdr),
        };
        encoded.map_err(|e| broken(e.to_string()))?;
        let sent = self.writer.borrow().write(Bytes::copy_from_slice(&self.cdr), Some(Timestamp::now()));
        sent.map_err(|e| match e {
            rustdds::dds::WriteError::WouldBlock { .. } => {
                broken("a reader does not acknowledge, and there is no room for more; is its host cut off?".to_string())
            }
            e => broken(e.to_string()),
        })
    }

    fn listeners(&self) -> usize {
        if self.revive().is_err() {
            return 0;
        }
        let writer = self.writer.borrow();
        while let Some(status) = writer.try_recv_status() {
            if let DataWriterStatus::PublicationMatched { current, .. } = status {
                self.matched.set(current.count().max(0) as usize);
            }
        }
        self.matched.get()
    }
}

impl Drop for Sending {
    /// What was sent is received by those who are there, as with any transport.
    fn drop(&mut self) {
        let (left, writer) = (self.shared.linger(), self.writer.get_mut());
        let _ = writer.wait_for_acknowledgments(left);
        if !self.shared.flushed.replace(true) {
            std::thread::sleep(FLUSH);
        }
    }
}
