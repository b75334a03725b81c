//! Between threads of one process: the same behaviour as over shared memory, without any.

use super::bell::{Bell, Looks};
use super::{Publisher, Subscriber, Transport, TransportError, capacity, check_layout, wrong_kind};
use crate::clock::now_ns;
use backdrive_msgs::Message;
use backdrive_msgs::topic::Topic;
use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Where the nodes of one run inside a process meet. Clones are the same hub; two hubs never meet.
#[derive(Clone, Default)]
pub struct Hub {
    topics: Arc<Mutex<HashMap<Topic, Arc<Mutex<Channel>>>>>,
}

#[derive(Default)]
struct Channel {
    publishers: usize,
    queues: Vec<Arc<Queue>>,
    history: VecDeque<Sent>,
}

/// A message, and when it was sent: CLOCK_MONOTONIC, ns.
#[derive(Clone, Copy)]
struct Sent {
    message: Message,
    at_ns: i64,
}

struct Queue {
    messages: Mutex<VecDeque<Sent>>,
    depth: usize,
    bell: Option<Arc<Bell>>,
}

impl Queue {
    fn push(&self, sent: Sent) {
        let mut messages = lock(&self.messages);
        if messages.len() == self.depth {
            messages.pop_front();
        }
        messages.push_back(sent);
    }
}

impl Hub {
    /// A node's way into the hub.
    pub fn join(&self) -> Inproc {
        Inproc { hub: self.clone(), bell: Arc::new(Bell::new()), seen: 0 }
    }

    fn channel(&self, topic: &Topic, action: &'static str) -> Result<Arc<Mutex<Channel>>, TransportError> {
        let mut topics = lock(&self.topics);
        if let Some(other) = topics.keys().find(|t| t.name == topic.name && t.kind != topic.kind) {
            let reason = format!("it carries {:?}, not {:?}", other.kind, topic.kind);
            return Err(TransportError::Open { topic: topic.name.clone(), action, reason });
        }
        Ok(Arc::clone(topics.entry(topic.clone()).or_default()))
    }
}

/// A node in a [`Hub`].
pub struct Inproc {
    hub: Hub,
    bell: Arc<Bell>,
    seen: u32,
}

impl Transport for Inproc {
    fn publisher(&mut self, topic: &Topic, _listeners: usize) -> Result<Box<dyn Publisher>, TransportError> {
        let channel = self.hub.channel(topic, "publish")?;
        lock(&channel).publishers += 1;
        Ok(Box::new(Sending { topic: topic.clone(), channel }))
    }

    fn subscriber(&mut self, topic: &Topic, depth: usize, wakes: bool) -> Result<Box<dyn Subscriber>, TransportError> {
        let channel = self.hub.channel(topic, "subscribe")?;
        let depth = depth.clamp(1, capacity(topic.kind).0);
        let queue =
            Arc::new(Queue { messages: Mutex::new(VecDeque::with_capacity(depth)), depth, bell: wakes.then(|| Arc::clone(&self.bell)) });
        let mut open = lock(&channel);
        open.history.iter().for_each(|m| queue.push(*m));
        open.queues.push(Arc::clone(&queue));
        drop(open);
        Ok(Box::new(Receiving { topic: topic.clone(), channel, queue, arrived_ns: 0 }))
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), TransportError> {
        self.bell.wait(&mut self.seen, 1, timeout, &mut Looks::None);
        Ok(())
    }
}

struct Sending {
    topic: Topic,
    channel: Arc<Mutex<Channel>>,
}

impl Publisher for Sending {
    fn send(&mut self, message: &Message) -> Result<(), TransportError> {
        if message.kind() != self.topic.kind {
            return Err(wrong_kind(&self.topic, message));
        }
        let mut channel = lock(&self.channel);
        let sent = Sent { message: *message, at_ns: now_ns() };
        let history = capacity(self.topic.kind).1;
        if history > 0 {
            if channel.history.len() == history {
                channel.history.pop_front();
            }
            channel.history.push_back(sent);
        }
        for queue in &channel.queues {
            queue.push(sent);
            if let Some(bell) = &queue.bell {
                bell.ring(0);
            }
        }
        Ok(())
    }

    fn listeners(&self) -> usize {
        lock(&self.channel).queues.len()
    }
}

impl Drop for Sending {
    fn drop(&mut self) {
        let mut channel = lock(&self.channel);
        channel.publishers -= 1;
        // The past of a topic is its publisher's, as over shared memory.
        if channel.publishers == 0 {
            channel.history.clear();
        }
    }
}

struct Receiving {
    topic: Topic,
    channel: Arc<Mutex<Channel>>,
    queue: Arc<Queue>,
    arrived_ns: i64,
}

impl Subscriber for Receiving {
    fn receive(&mut self) -> Result<Option<Message>, TransportError> {
        let Some(Sent { message, at_ns }) = lock(&self.queue.messages).pop_front() else {
            return Ok(None);
        };
        self.arrived_ns = at_ns;
        check_layout(&self.topic.name, &message)?;
        Ok(Some(message))
    }

    fn arrived_ns(&self) -> i64 {
        self.arrived_ns
    }

    fn has_publisher(&self) -> bool {
        lock(&self.channel).publishers > 0
    }
}

impl Drop for Receiving {
    fn drop(&mut self) {
        lock(&self.channel).queues.retain(|q| !Arc::ptr_eq(q, &self.queue));
    }
}

/// A queue is whole between any two statements that hold it, so a panic in other code does not damage it.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
