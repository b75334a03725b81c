//! Text between the supervisors of a run on several hosts: a topic of `std_msgs/String`.
//!
//! Best effort: every message is repeated soon, and a lost one must not hold back the next.

use super::inbox::ringing;
use super::node::Ros2;
use super::participant::{Participant, open_error};
use super::shared::Shared;
use crate::transport::TransportError;
use crate::transport::bell::{Bell, Looks};
use rustdds::QosPolicyBuilder;
use rustdds::no_key::{DataWriterCdr, SimpleDataReaderCdr};
use rustdds::policy::{Durability, History};
use serde::{Deserialize, Serialize};
use std::rc::Rc;
use std::sync::Arc;
use std::task::Waker;

/// `std_msgs/msg/String`.
#[derive(Serialize, Deserialize)]
struct Words {
    data: String,
}

/// A topic on which everybody speaks and hears everybody, oneself included.
pub struct Talk {
    topic: String,
    ends: Ends,
    life: u32,
    bell: Arc<Bell>,
    seen: u32,
    waker: Waker,
    shared: Rc<Shared>,
}

struct Ends {
    writer: DataWriterCdr<Words>,
    reader: SimpleDataReaderCdr<Words>,
    // Last: it outlives its ends.
    _participant: Arc<Participant>,
}

impl Ros2 {
    /// Joins a topic of text; `topic` is an absolute ROS name.
    ///
    /// # Errors
    /// The middleware refuses.
    pub fn talk(&self, topic: &str) -> Result<Talk, TransportError> {
        let bell = Arc::new(Bell::new());
        let waker = ringing(&bell);
        let (ends, life, shared) = (Ends::open(&self.shared, topic)?, self.shared.life.get(), Rc::clone(&self.shared));
        Ok(Talk { topic: topic.to_string(), ends, life, bell, seen: 0, waker, shared })
    }
}

impl Ends {
    fn open(shared: &Shared, topic: &str) -> Result<Ends, TransportError> {
        let participant = shared.participant();
        let qos = QosPolicyBuilder::new().best_effort().durability(Durability::Volatile).history(History::KeepLast { depth: 256 }).build();
        let failed = |e: rustdds::dds::CreateError| open_error(topic, "talk", &e);
        let dds = participant.raw_topic(topic, "std_msgs", "String", &qos).map_err(failed)?;
        let (publisher, subscriber) = participant.ends();
        let writer = publisher.create_datawriter_no_key_cdr(&dds, Some(qos.clone())).map_err(failed)?;
        let reader = subscriber.create_simple_datareader_no_key(&dds, Some(qos)).map_err(failed)?;
        Ok(Ends { writer, reader, _participant: participant })
    }
}

impl Talk {
    /// Sends a text to all present participants. What cannot be sent is dropped: everything is sent repeatedly.
    pub fn say(&self, text: &str) {
        let _ = self.ends.writer.write(Words { data: text.to_string() }, None);
    }

    /// The next message, if there is one. What is not text is skipped.
    pub fn hear(&self) -> Option<String> {
        self.ends.reader.set_waker(Some(self.waker.clone()));
        loop {
            match self.ends.reader.try_take_one() {
                Ok(Some(words)) => return Some(words.into_value().data),
                Ok(None) => return None,
                Err(_) => continue,
            }
        }
    }

    /// Waits until a message came after the last look, or the time is over.
    pub fn wait(&mut self, timeout: std::time::Duration) {
        self.shared.watch_clock();
        if self.life != self.shared.life.get()
            && let Ok(ends) = Ends::open(&self.shared, &self.topic)
        {
            (self.ends, self.life) = (ends, self.shared.life.get());
        }
        self.bell.wait(&mut self.seen, 1, timeout, &mut Looks::None);
    }
}
