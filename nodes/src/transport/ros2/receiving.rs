//! A subscriber over ROS 2: one speaker per topic, nothing late, nothing twice.

use super::inbox::{Inbox, Taken, locked, ringing};
use super::refusals::Refusals;
use super::shared::Shared;
use crate::transport::{Subscriber, TransportError, capacity};
use backdrive_msgs::Message;
use backdrive_msgs::topic::Topic;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::{Arc, Mutex};

pub(super) struct Receiving {
    shared: Rc<Shared>,
    wakes: bool,
    inbox: Arc<Mutex<Inbox>>,
    arrived_ns: i64,
}

impl Receiving {
    pub fn new(shared: &Rc<Shared>, topic: &Topic, depth: usize, wakes: bool) -> Result<Receiving, TransportError> {
        let mut inbox = Inbox {
            reader: shared.participant().reader(topic, shared.delivery)?,
            life: shared.life.get(),
            topic: topic.clone(),
            depth: depth.clamp(1, capacity(topic.kind).0),
            awaited: wakes,
            waker: ringing(&shared.bell),
            matched: 0,
            crowded: None,
            from: Taken::new(shared.identity.as_ref(), topic),
            queue: VecDeque::new(),
            newest_ns: i64::MIN,
            late: 0,
            refusals: Refusals::default(),
        };
        inbox.drain();
        let inbox = Arc::new(Mutex::new(inbox));
        let mut all = locked(&shared.inboxes);
        all.retain(|other| other.strong_count() > 0);
        all.push(Arc::downgrade(&inbox));
        Ok(Receiving { shared: Rc::clone(shared), wakes, inbox, arrived_ns: 0 })
    }

    /// Has a reader of the participant that the node has now.
    fn revive(&self, inbox: &mut Inbox) -> Result<(), TransportError> {
        if inbox.life != self.shared.life.get() {
            inbox.life = self.shared.life.get();
            inbox.matched = 0;
            inbox.reader = self.shared.participant().reader(&inbox.topic, self.shared.delivery)?;
        }
        Ok(())
    }
}

impl Subscriber for Receiving {
    fn receive(&mut self) -> Result<Option<Message>, TransportError> {
        let mut inbox = locked(&self.inbox);
        if inbox.queue.is_empty() {
            self.shared.watch_clock();
            self.revive(&mut inbox)?;
            inbox.drain();
            if inbox.queue.is_empty() {
                inbox.hear_statuses();
            }
        }
        let Some((entry, arrived_ns)) = inbox.queue.pop_front() else {
            // Behind what is genuine: a stranger must not hold it up.
            return inbox.complaint().map_or(Ok(None), Err);
        };
        drop(inbox);
        self.arrived_ns = arrived_ns;
        entry.map(Some)
    }

    fn arrived_ns(&self) -> i64 {
        self.arrived_ns
    }

    fn has_publisher(&self) -> bool {
        let mut inbox = locked(&self.inbox);
        if self.revive(&mut inbox).is_err() {
            return false;
        }
        inbox.is_met()
    }

    fn refused(&self) -> u64 {
        locked(&self.inbox).refusals.count()
    }

    fn stranger(&mut self) -> Option<TransportError> {
        locked(&self.inbox).stranger()
    }

    fn set_awaited(&mut self, awaited: bool) {
        let mut inbox = locked(&self.inbox);
        let was = std::mem::replace(&mut inbox.awaited, awaited && self.wakes);
        if inbox.awaited && !was {
            inbox.drain();
            if !inbox.queue.is_empty() {
                self.shared.bell.ring(0);
            }
        } else if was && !inbox.awaited {
            inbox.reader.set_waker(None);
        }
    }

    fn late(&self) -> u64 {
        locked(&self.inbox).late
    }
}
